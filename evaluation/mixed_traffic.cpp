#include "pictura/evaluation/mixed_traffic.h"

#include <algorithm>
#include <optional>
#include <utility>

#include <fmt/ranges.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/configuration/simulator_section.h"
#include "pictura/evaluation/world_arrays.h"
#include "pictura/policy/session.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/controllers/shared_control.h"
#include "pictura/simulator/rules/impairment.h"
#include "pictura/simulator/simulator_options.h"

namespace pictura {

std::vector<std::string> impairment_names() {
  std::vector<std::string> names;
  visit_impairments(OtherShares{}, [&names](const char* name, float) { names.emplace_back(name); });
  return names;
}

namespace {

bool is_controller(const std::string& name) {
  const std::vector<std::string> names = town_controller_names();
  return std::find(names.begin(), names.end(), name) != names.end();
}

/// Returns the impairment of this name; `none` if no impairment has it.
Impairment impairment_named(const std::string& text) {
  const std::vector<std::string> names = impairment_names();
  const auto index = std::find(names.begin(), names.end(), text) - names.begin();
  return index == std::ssize(names) ? Impairment::none : static_cast<Impairment>(1 + index);
}

SessionOptions options_of(const DriverOptions& options, Device device) {
  SessionOptions result;
  result.device = name_of(device);
  result.simulator = options.simulator;
  result.num_threads = options.num_threads;
  return result;
}

}  // namespace

std::vector<OtherDriver> other_drivers(const std::vector<std::string>& texts) {
  std::vector<OtherDriver> others;
  double sum = 0;
  for (const std::string& text : texts) {
    const std::optional<NamedShare> parsed = parse_share(text);
    if (!parsed) {
      fail_usage(
          "others: expected a policy's file, one of {}, or {}, and its share above 0, for instance lane=0.25; got '{}'",
          fmt::join(town_controller_names(), ", "), fmt::join(impairment_names(), ", "), text);
    }
    const auto& [name, share] = *parsed;
    const Impairment impairment = impairment_named(name);
    const auto is_same = [impairment](const OtherDriver& other) { return other.impairment == impairment; };
    if (impairment != Impairment::none && std::any_of(others.begin(), others.end(), is_same)) {
      fail_usage("others: {} is given twice", name);
    }
    others.push_back({name, share, impairment});
    sum += share;
  }
  if (others.size() > kMaxOtherDrivers) {
    fail_usage("others: expected at most {}, got {}", kMaxOtherDrivers, others.size());
  }
  if (sum >= 1)
    fail_usage("others: expected shares that sum to less than 1, since some vehicles must be evaluated, got {}", sum);
  return others;
}

/// A policy has a session and, for images, a renderer; a controller and an impairment have neither.
struct MixedTraffic::Other {
  OtherDriver driver;
  std::unique_ptr<PolicySession> session;
  std::unique_ptr<Renderer> renderer;
};

MixedTraffic::MixedTraffic(const std::vector<OtherDriver>& others, const DriverOptions& options, Device device,
                           const CompiledMaps& maps)
    : options_(options) {
  for (const OtherDriver& driver : others) {
    auto other = std::make_unique<Other>();
    other->driver = driver;
    const bool is_impaired = driver.impairment != Impairment::none;
    if (is_impaired) unimpaired_share_ -= driver.share;
    const bool is_built_in = !options.controller.empty() && !options.make_own_controller;
    if (is_impaired && driver.impairment != Impairment::phantom_braking && is_built_in) {
      fail_usage("others: {}: has no effect on the controller {}, which does not use observations", driver.name,
                 options.controller);
    }
    if (!is_impaired && !is_controller(driver.name)) {
      other->session = std::make_unique<PolicySession>(driver.name, options_of(options, device));
      other->renderer = other->session->make_renderer();
      if (other->renderer) upload_maps(maps, {}, other->renderer.get());
    }
    others_.push_back(std::move(other));
  }
}

MixedTraffic::~MixedTraffic() = default;

size_t MixedTraffic::num_drivers() const { return others_.size() + 1; }

std::string MixedTraffic::name(size_t driver) const { return driver == 0 ? "" : others_[driver - 1]->driver.name; }

std::vector<std::string> MixedTraffic::setting() const {
  std::vector<std::string> texts;
  for (const std::unique_ptr<Other>& other : others_) {
    texts.push_back(
        fmt::format("{}={}", other->session ? other->session->policy_hash() : other->driver.name, other->driver.share));
  }
  return texts;
}

SimulatorConfig MixedTraffic::adapted(SimulatorConfig world) const {
  for (const std::unique_ptr<Other>& other : others_) {
    visit_impairments(world.others, [&other](const char* name, float& share) {
      if (other->driver.name == name) share = static_cast<float>(other->driver.share);
    });
    if (other->session) world.add_observations(other->session->training_world());
  }
  return world;
}

size_t MixedTraffic::impaired_driver(Impairment impairment) const {
  size_t driver = 1;
  while (others_[driver - 1]->driver.impairment != impairment) ++driver;
  return driver;
}

size_t MixedTraffic::drawn_driver(uint32_t global_world, uint32_t agent) const {
  RandomStream random({.seed = options_.seed, .world = global_world, .agent = agent, .purpose = Purpose::driver});
  double left = unimpaired_share_ * static_cast<double>(random.uniform());
  for (size_t i = 0; i < others_.size(); ++i) {
    if (others_[i]->driver.impairment != Impairment::none) continue;
    left -= others_[i]->driver.share;
    if (left < 0) return i + 1;
  }
  return 0;
}

std::vector<uint8_t> MixedTraffic::driver_of_slots(Simulator& simulator) const {
  const std::vector<AgentClass> agent_class = WorldArrays::values_of_slots(simulator, simulator.state().agent_class);
  const std::vector<int32_t> slot_begin = host_copy(simulator.slots().slot_begin, simulator.device());
  std::vector<uint8_t> driver_of_slot(agent_class.size(), 0);
  for (size_t world = 0; world < simulator.worlds().size(); ++world) {
    const uint32_t global_world = simulator.worlds()[world].global_world;
    for (int32_t slot = slot_begin[world]; slot < slot_begin[world + 1]; ++slot) {
      const auto agent = static_cast<uint32_t>(slot - slot_begin[world]);
      const Impairment impairment =
          draw_impairment(simulator.config().others, options_.seed, global_world, agent, /*episode=*/0);
      const bool is_vehicle = agent_class[static_cast<size_t>(slot)] == AgentClass::vehicle;
      driver_of_slot[static_cast<size_t>(slot)] =
          static_cast<uint8_t>(impairment != Impairment::none ? impaired_driver(impairment)
                               : is_vehicle                   ? drawn_driver(global_world, agent)
                                                              : 0);
    }
  }
  return driver_of_slot;
}

Driving MixedTraffic::share(Driving own, Simulator& simulator, const std::vector<uint8_t>& driver_of_slot) const {
  if (others_.empty()) return own;
  std::vector<Driver> drivers;
  // Driver 0 also drives impaired agents.
  const auto is_impaired = [this](size_t driver) {
    return driver > 0 && others_[driver - 1]->driver.impairment != Impairment::none;
  };
  for (size_t i = 0; i < num_drivers(); ++i) {
    if (is_impaired(i)) continue;
    std::vector<uint8_t> mask(driver_of_slot.size());
    std::transform(driver_of_slot.begin(), driver_of_slot.end(), mask.begin(),
                   [&](size_t its) { return its == i || (i == 0 && is_impaired(its)); });
    const auto memory = std::make_shared<const DeviceCopy<uint8_t>>(mask, simulator.device());
    Driver driver{std::move(own.controller), memory->span(), memory};
    if (i > 0) {
      const Other& other = *others_[i - 1];
      driver.controller = other.session ? policy_controller(*other.session, other.renderer.get(), options_, simulator)
                                        : make_controller(other.driver.name, simulator, options_.seed);
    }
    drivers.push_back(std::move(driver));
  }
  return {std::make_unique<SharedControl>(std::move(drivers)), [&simulator] { return count_active(simulator); }};
}

}  // namespace pictura
