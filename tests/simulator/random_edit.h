// Random edits of agents: moves, also onto other agents, speeds, goals and status.
#pragma once

#include <vector>

#include "pictura/common/rng.h"
#include "pictura/simulator/agent_state_arrays.h"

namespace pictura::testing {

/// Random, valid edit of about a third of the agents of a state on the host. number: selects the random numbers.
class RandomEdit {
 public:
  RandomEdit(const AgentStateView& state, int num_slots, uint32_t number) {
    for (int slot = 0; slot < num_slots; ++slot) {
      RandomStream random(
          {.seed = 7, .world = number, .agent = static_cast<uint32_t>(slot), .purpose = Purpose::action});
      if (random.uniform() < 0.66f) continue;
      const auto is_placed = [&state](int of) { return state.status[of] != AgentStatus::absent; };
      const int other = random.below(num_slots);
      const int of = random.uniform() < 0.1f && is_placed(other) ? other : slot;
      slots_.push_back(slot);
      x_m_.push_back(state.x_m[of] + random.uniform(-3, 3));
      y_m_.push_back(state.y_m[of] + random.uniform(-3, 3));
      z_m_.push_back(state.z_m[of]);
      heading_rad_.push_back(state.heading_rad[of] + random.uniform(-7, 7));
      speed_mps_.push_back(random.uniform(-1, 15));
      const bool has_goal = state.goal_lane[slot] >= 0;
      status_.push_back(!has_goal                 ? AgentStatus::absent
                        : random.uniform() < 0.1f ? AgentStatus::absent
                        : random.uniform() < 0.1f ? AgentStatus::halted
                                                  : AgentStatus::active);
      for (int i = 0; i < kNumWaypoints; ++i) waypoint_x_m_.push_back(x_m_.back() + random.uniform(-30, 30));
    }
  }

  Array slots() const { return Array(slots_); }
  std::vector<NamedArray> fields() const {
    return {{"x_m", Array(x_m_)},
            {"y_m", Array(y_m_)},
            {"z_m", Array(z_m_)},
            {"heading_rad", Array(heading_rad_)},
            {"speed_mps", Array(speed_mps_)},
            {"status", Array(status_)},
            {"waypoint_x_m", Array(waypoint_x_m_.data(), {count(), kNumWaypoints}, Device{})}};
  }

 private:
  int64_t count() const { return static_cast<int64_t>(slots_.size()); }

  std::vector<int32_t> slots_;
  std::vector<float> x_m_, y_m_, z_m_, heading_rad_, speed_mps_, waypoint_x_m_;
  std::vector<AgentStatus> status_;
};

}  // namespace pictura::testing
