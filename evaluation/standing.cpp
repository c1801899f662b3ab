#include "pictura/evaluation/standing.h"

#include <cmath>
#include <utility>

#include "pictura/evaluation/world_arrays.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/signal.h"

namespace pictura {

namespace {

// Maximum distance of a waiting vehicle's front bumper from the stop line. Vehicles behind the first one are farther
// away, and may close up, so they do not count as waiting.
constexpr float kWaitReach_m = 5;
constexpr float kStuckWithin_m = 5, kStuckFor_s = 60;

// Returns the red light at whose line the vehicle is first, or -1.
int32_t red_light_before(const MapView& map, const AgentBox& box, const WorldArrays& now, size_t first_light) {
  const Vec2 bumper = front_bumper(box), forward{box.cos_heading, box.sin_heading};
  const Span<const int32_t> lights = items_at(map.stop_line_cells, bumper);
  for (size_t i = 0; i < lights.size(); ++i) {
    const StopLine& line = map.stop_lines[lights[i]];
    const Vec2 past = bumper - line.middle_m.xy();
    const float before_m = -dot(past, line.direction);
    if (now.is_red(first_light + size_t(lights[i])) && before_m >= 0 && before_m <= kWaitReach_m &&
        is_within_ends(line, past) && holds(line, forward, box.center_m.z)) {
      return lights[i];
    }
  }
  return -1;
}

}  // namespace

StandingObserver::StandingObserver(Simulator& simulator)
    : StandingObserver(simulator, std::vector<uint8_t>(static_cast<size_t>(simulator.num_slots()), 0), 1) {}

StandingObserver::StandingObserver(Simulator& simulator, std::vector<uint8_t> driver_of_slot, size_t num_drivers)
    : simulator_(simulator),
      awaited_light_(static_cast<size_t>(simulator.num_slots()), -1),
      progress_(static_cast<size_t>(simulator.num_slots())),
      driver_of_slot_(std::move(driver_of_slot)),
      counts_(num_drivers, std::vector<StandingCounts>(simulator.worlds().size())) {}

void StandingObserver::after_step(const StepResult& /*result*/) {
  ++step_;
  const WorldArrays now(simulator_);
  const std::vector<float> distance_m = WorldArrays::values_of_slots(simulator_, simulator_.state().distance_m);
  const float dt_s = simulator_.config().dt_s;
  for (size_t world = 0; world < simulator_.worlds().size(); ++world) {
    const MapView map = simulator_.maps()[simulator_.worlds()[world].map]->rules.view();
    for (size_t agent = 0; agent < now.num_agents(world); ++agent) {
      const size_t slot = now.first_slot(world) + agent;
      int32_t& awaited = awaited_light_[slot];
      if (now.agent_class[slot] != AgentClass::vehicle || now.status[slot] != AgentStatus::active) {
        awaited = -1;
        progress_[slot] = {step_, 0};  // another agent may enter the slot
        continue;
      }
      StandingCounts& counts = counts_[driver_of_slot_[slot]][world];
      const float speed_mps = now.speed_mps[slot];
      ++counts.driven_steps;
      counts.reversing_steps += speed_mps < -kRest_mps;
      Progress& progress = progress_[slot];
      // A distance smaller than before means that a new agent uses the slot.
      const float gone_m = distance_m[slot] - progress.distance_m;
      if (gone_m < 0 || gone_m > kStuckWithin_m) progress = {step_, distance_m[slot]};

      const int32_t light = red_light_before(map, now.boxes[now.first_box(world) + agent], now, now.first_light(world));
      const bool waits_on = light >= 0 && light == awaited;
      const bool begins = light >= 0 && !waits_on && std::fabs(speed_mps) <= kRest_mps;
      awaited = waits_on || begins ? light : -1;
      counts.red_waits += begins;
      if (waits_on) counts.red_wait_moved_m += static_cast<double>(std::fabs(speed_mps) * dt_s);
    }
  }
}

std::vector<StandingCounts> StandingObserver::counts(size_t driver) const {
  std::vector<StandingCounts> counts = counts_[driver];
  const WorldArrays now(simulator_);
  const auto stuck_steps = static_cast<int>(std::lround(kStuckFor_s / simulator_.config().dt_s));
  for (size_t world = 0; world < counts.size(); ++world) {
    for (size_t slot = now.first_slot(world); slot < now.first_slot(world + 1); ++slot) {
      counts[world].stuck_at_end += driver_of_slot_[slot] == driver && now.agent_class[slot] == AgentClass::vehicle &&
                                    now.status[slot] == AgentStatus::active &&
                                    step_ - progress_[slot].step >= stuck_steps;
    }
  }
  return counts;
}

}  // namespace pictura
