// Totals of a simulator, bit-identical on every executor: agent i of a world adds to bin i mod kTotalsBins, then the
// bins are added in order.
#pragma once

#include "pictura/common/portable/hd.h"
#include "pictura/simulator/reward_terms.h"

namespace pictura {

constexpr int kTotalsBins = 32;

constexpr float kRest_mps = 0.3f;  // maximum speed at rest

// X(total, name in a run's log, events): agent-steps with at least one of the events.
#define PICTURA_EVENT_TOTALS(X)                                \
  X(goals_reached, goals, kEventMetricGoal)                    \
  X(waypoints_reached, waypoints, kEventWaypoint | kEventGoal) \
  X(collisions, collisions, kEventCollision)                   \
  X(at_fault_collisions, at_fault_collisions, kEventAtFault)   \
  X(off_road, off_road, kEventOffRoad)                         \
  X(red_light, red_light, kEventRedLight)                      \
  X(wall_contacts, wall_contacts, kEventWall)

// COUNT is an integer, SUM a floating-point sum, TERMS such a sum for each reward term.
#define PICTURA_TOTALS(COUNT, SUM, TERMS)                                                       \
  COUNT(agent_steps) /* one per step and agent for which is_counted() in rules/episode.h */     \
  COUNT(slot_steps)  /* number of slots times steps */                                          \
  COUNT(episodes)    /* number of times that a step reset a world */                            \
  PICTURA_EVENT_TOTALS(COUNT)                                                                   \
  SUM(distance_m)                                                                               \
  SUM(reward)                                                                                   \
  TERMS(reward_terms)             /* terms of `reward`; their sum differs by rounding */        \
  COUNT(finished_agent_episodes)  /* agents whose episode ended */                              \
  SUM(finished_return)            /* sum of the returns of these agents */                      \
  COUNT(finished_passed_waypoint) /* of these agents, those that passed a waypoint */           \
  COUNT(finished_moved)           /* of these agents, those that moved faster than kRest_mps */ \
  SUM(finished_first_motion_s)    /* over agents that moved: time from start to motion */

/// Totals of controlled agents since the simulator's construction or its last set_worlds().
struct SimulatorTotals {
#define COUNT(name, ...) int64_t name = 0;
#define SUM(name) double name = 0;
#define TERMS(name) RewardTermsOf<double> name;
  PICTURA_TOTALS(COUNT, SUM, TERMS)
#undef COUNT
#undef SUM
#undef TERMS

  PICTURA_HD void add(const SimulatorTotals& part) { visit(*this, part, Add{}, Add{}); }
  PICTURA_HD void subtract(const SimulatorTotals& before) { visit(*this, before, Subtract{}, Subtract{}); }

  template <typename Other, typename VisitCount, typename VisitSum>
  PICTURA_HD static void visit(SimulatorTotals& a, Other& b, const VisitCount& visit_count, const VisitSum& visit_sum) {
#define COUNT(name, ...) visit_count(a.name, b.name);
#define SUM(name) visit_sum(a.name, b.name);
#define X(term) visit_sum(a.reward_terms.term, b.reward_terms.term);
#define TERMS(...) PICTURA_REWARD_TERMS(X)
    PICTURA_TOTALS(COUNT, SUM, TERMS)
#undef COUNT
#undef SUM
#undef X
#undef TERMS
  }

 private:
  struct Add {
    template <typename T>
    PICTURA_HD void operator()(T& sum, T value) const {
      sum += value;
    }
  };
  struct Subtract {
    template <typename T>
    PICTURA_HD void operator()(T& difference, T value) const {
      difference -= value;
    }
  };
};

}  // namespace pictura
