// What a simulator counts. Sums of floating-point numbers have one order on every executor: agent i of a world adds to
// bin i mod kTotalsBins, and the bins are added up in order.
#pragma once

#include "pictura/common/portable/hd.h"
#include "pictura/simulator/reward_terms.h"

namespace pictura {

constexpr int kTotalsBins = 32;

constexpr float kRest_mps = 0.3f;  // agents up to this speed are at rest

/// Totals since construction; counts are of controlled agents.
struct SimulatorTotals {
  int64_t agent_steps = 0;  // active agents advanced by one step
  int64_t slot_steps = 0;   // slots times steps
  int64_t episodes = 0;     // worlds reset after their first episode
  int64_t goals_reached = 0, waypoints_reached = 0;
  int64_t collisions = 0, at_fault_collisions = 0, off_road = 0, red_light = 0, wall_contacts = 0;
  double distance_m = 0;
  double reward = 0;
  RewardTermsOf<double> reward_terms;    // of which `reward` is made, but for rounding
  int64_t finished_agent_episodes = 0;   // agents whose episode ended
  double finished_return = 0;            // sum of their returns
  int64_t finished_passed_waypoint = 0;  // of these agents, those that passed a waypoint
  int64_t finished_moved = 0;            // ... and those that were faster than kRest_mps in some step
  double finished_first_motion_s = 0;    // sum over the latter of the time from their start to the end of that step

  /// Calls visit(member of a, member of b) for all counts, and for all sums of floating-point numbers.
  template <typename Other, typename Visit>
  PICTURA_HD static constexpr void visit_counts(SimulatorTotals& a, Other& b, Visit&& visit) {
    visit(a.agent_steps, b.agent_steps);
    visit(a.slot_steps, b.slot_steps);
    visit(a.episodes, b.episodes);
    visit(a.goals_reached, b.goals_reached);
    visit(a.waypoints_reached, b.waypoints_reached);
    visit(a.collisions, b.collisions);
    visit(a.at_fault_collisions, b.at_fault_collisions);
    visit(a.off_road, b.off_road);
    visit(a.red_light, b.red_light);
    visit(a.wall_contacts, b.wall_contacts);
    visit(a.finished_agent_episodes, b.finished_agent_episodes);
    visit(a.finished_passed_waypoint, b.finished_passed_waypoint);
    visit(a.finished_moved, b.finished_moved);
  }
  template <typename Other, typename Visit>
  PICTURA_HD static constexpr void visit_sums(SimulatorTotals& a, Other& b, Visit&& visit) {
    visit(a.distance_m, b.distance_m);
    visit(a.reward, b.reward);
#define X(name) visit(a.reward_terms.name, b.reward_terms.name);
    PICTURA_REWARD_TERMS(X)
#undef X
    visit(a.finished_return, b.finished_return);
    visit(a.finished_first_motion_s, b.finished_first_motion_s);
  }

  PICTURA_HD void add(const SimulatorTotals& part) {
    visit_counts(*this, part, Add{});
    visit_sums(*this, part, Add{});
  }
  /// What has happened since `before`.
  PICTURA_HD void subtract(const SimulatorTotals& before) {
    visit_counts(*this, before, Subtract{});
    visit_sums(*this, before, Subtract{});
  }

  /// Whether each member is one of those that are visited.
  PICTURA_HD static constexpr bool visits_all() {
    SimulatorTotals totals;
    size_t bytes = 0;
    visit_counts(totals, totals, CountBytes{&bytes});
    visit_sums(totals, totals, CountBytes{&bytes});
    return bytes == sizeof(SimulatorTotals);
  }

 private:
  struct Subtract {
    template <typename T>
    PICTURA_HD void operator()(T& difference, T value) const {
      difference -= value;
    }
  };
  struct Add {
    template <typename T>
    PICTURA_HD void operator()(T& sum, T value) const {
      sum += value;
    }
  };
  struct CountBytes {
    size_t* bytes;
    PICTURA_HD constexpr void operator()(int64_t count, int64_t) const { *bytes += sizeof(count); }
    PICTURA_HD constexpr void operator()(double sum, double) const { *bytes += sizeof(sum); }
  };
};
static_assert(SimulatorTotals::visits_all());

}  // namespace pictura
