#include "pictura/simulator/controllers/host_controllers.h"

#include <algorithm>

#include "pictura/common/array.h"
#include "pictura/common/error.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/controllers/idm.h"
#include "pictura/simulator/controllers/inverse_actions.h"
#include "pictura/simulator/controllers/lane_keeping.h"
#include "pictura/simulator/rules/control.h"

namespace pictura {

void check_controller_arrays(std::string_view who, const SimulatorArrays& input, Device device,
                             Span<const uint8_t> mask, Span<const Command> commands) {
  const size_t num_slots = input.slots.world_of_slot.size();
  PICTURA_CHECK(input.device == device, "controller {}: expected input on {}, got {}", who, name_of(device),
                name_of(input.device));
  PICTURA_CHECK(mask.empty() || mask.size() == num_slots, "controller {}: expected a mask of {} slots, got {}", who,
                num_slots, mask.size());
  PICTURA_CHECK(commands.size() == num_slots, "controller {}: expected memory for {} commands, got {}", who, num_slots,
                commands.size());
}

namespace {

template <typename Rule>
void fill(const Rule& rule, Span<const uint8_t> mask, Span<Command> commands_out) {
  for (size_t slot = 0; slot < commands_out.size(); ++slot) {
    if (mask.empty() || mask[slot]) commands_out[slot] = rule(slot);
  }
}

class RandomController final : public Controller {
 public:
  explicit RandomController(uint64_t seed) : seed_(seed) {}
  std::string_view name() const override { return "random"; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name(), input, Device{}, mask, commands_out);
    fill(RandomCommands{seed_, input.slots, input.world_totals}, mask, commands_out);
  }

 private:
  uint64_t seed_;
};

/// Controller whose commands come from a default-constructed Rule. `name` must be a string literal.
template <typename Rule>
class RuleController final : public Controller {
 public:
  explicit RuleController(std::string_view name) : name_(name) {}
  std::string_view name() const override { return name_; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name(), input, Device{}, mask, commands_out);
    fill(Rule{}, mask, commands_out);
  }

 private:
  std::string_view name_;
};

}  // namespace

std::vector<std::string> town_controller_names() { return {"random", "idle", "lane", "idm_lanes"}; }
std::vector<std::string> record_controller_names() { return {"log", "inverse", "idm"}; }
bool drives_on_host(std::string_view name) { return name == "lane" || name == "idm" || name == "idm_lanes"; }
std::vector<std::string> host_controller_names() {
  std::vector<std::string> names = town_controller_names();
  for (const std::string& name : record_controller_names()) names.push_back(name);
  return names;
}

void check_worlds(std::string_view controller, const Simulator& simulator) {
  const bool needs_record = controller == "log" || controller == "inverse";
  for (const WorldSpec& world : simulator.worlds()) {
    const CompiledMap& map = *simulator.maps()[world.map];
    if (needs_record && !map.scenario) {
      fail_usage("controller {}: world {}: expected a recorded scene, got map {}, which has no recording", controller,
                 world.global_world, map.road->name);
    }
    if (controller == "lane" && map.scenario) {
      fail_usage("controller lane: world {}: expected a map of roads, got recorded scene {}", world.global_world,
                 map.scenario->id);
    }
  }
}

std::unique_ptr<Controller> make_host_controller(const std::string& name, const Simulator& simulator, uint64_t seed) {
  check_worlds(name, simulator);
  if (name == "random") return std::make_unique<RandomController>(seed);
  if (name == "idle") return std::make_unique<RuleController<IdleCommands>>("idle");
  if (name == "lane") return std::make_unique<LaneKeepingController>(simulator);
  if (name == "log") return std::make_unique<RuleController<RecordedCommands>>("log");
  if (name == "inverse") return std::make_unique<InverseController>(simulator);
  if (name == "idm") return std::make_unique<IdmController>(simulator);
  if (name == "idm_lanes") return std::make_unique<IdmController>(simulator, IdmPaths::lanes);
  fail_usage("controller: expected one of {}; got '{}'", fmt::join(host_controller_names(), ", "), name);
}

}  // namespace pictura
