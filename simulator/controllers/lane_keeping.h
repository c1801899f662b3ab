// The lane keeper: a controller for vehicles and cyclists. An agent drives through its waypoints by pure pursuit of
// lanes. It stops at red lights and behind other road users, and gives way when it changes lanes. Where it would leave
// the road, it searches for a plan that stays on the road; without such a plan, it stops. Runs only on the host.
#pragma once

#include <array>
#include <memory>
#include <optional>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/controllers/lane_path.h"
#include "pictura/simulator/controllers/steering_search.h"
#include "pictura/simulator/rules/step.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct SimulatorSetup;

/// Drives one vehicle or cyclist through one life.
class LaneKeepingAgent {
 public:
  /// Must be constructed before the first step of the agent's life. `graph` is the lane graph of the world's map. The
  /// graph and the arrays of `world` must outlive this object. `search_nodes` is the search budget left by the slot's
  /// previous life.
  LaneKeepingAgent(const WorldView& world, int agent, const LaneGraph& graph, size_t search_nodes = kMaxSearchNodes);

  int32_t act();
  int32_t life() const { return life_; }
  /// Remaining search budget.
  size_t search_nodes() const { return search_nodes_; }
  /// Steps of waiting at red lights.
  int stops() const { return stops_; }
  /// Steps with the rear axle more than kOffPath_m from the path.
  int steps_off_path() const { return steps_off_path_; }
  static constexpr float kOffPath_m = 1;

 private:
  // A search node takes 1 to 4 us. On open maps, whose roads end, a search takes at most 10 ms per step. On other maps,
  // a plan may need 130,000 nodes.
  static constexpr size_t kMaxSearchNodes = 300'000, kMaxSearchNodesOfOpen = 2'000, kSearchNodesPerStep = 500,
                          kMinSearchNodes = 20'000;

  enum class Driving { pursues, brakes, brakes_straight };  // follow the path; brake on it; brake straight ahead

  void follow_goals();
  void plan();
  void find_place();
  size_t ahead(size_t from, float distance_m) const;
  bool renew_plan(const Motion& now);
  void drop_plan();
  bool is_plan_safe() const { return plan_.is_clear && next_planned_ < plan_.actions.size() / 2; }
  DrivingPlan plan_elsewhere(DrivingPlan plan);
  float steer_to(const Motion& now, size_t place) const;
  int32_t pursuing_action(const Motion& now, size_t place, float wanted_mps) const;
  int32_t action_of(Driving how, const Motion& now, size_t place) const;
  bool stays_on_road(Motion now, int32_t action, Driving how) const;
  bool can_stop_after(const Motion& now, int32_t action) const;
  int32_t braking_action(const Motion& now) const;
  float speed_before_light(const Motion& now);
  float to_closed_line(const Motion& now) const;
  float speed_behind_others() const;
  bool has_right_of_way(int other) const;
  bool is_changing_lane() const;
  bool follows(const AgentBox& other) const;
  const std::vector<PathPoint>& points() const { return path_.points(); }

  const WorldView world_;
  const int self_, slot_;
  const int32_t life_;
  const DrivenAgent agent_;
  std::array<RoutePoint, kNumWaypoints> waypoints_;
  int32_t chain_ = -1;
  LanePath path_;
  size_t place_ = 0;                           // nearest point of the path
  std::array<size_t, kNumWaypoints> goals_{};  // indices of the path's points at the waypoints
  DrivingPlan plan_;
  size_t next_planned_ = 0;
  const size_t max_search_nodes_;
  size_t search_nodes_;
  size_t min_search_nodes_ = 0;  // minimum budget for the next search
  bool halts_ = false;           // until a plan is found
  int stops_ = 0, steps_off_path_ = 0;
};

/// Drives all vehicles and cyclists; pedestrians stand still.
class LaneKeepingController final : public Controller {
 public:
  /// Copies the configuration, maps and worlds of a simulator on any device.
  explicit LaneKeepingController(const Simulator& simulator);
  ~LaneKeepingController() override;

  std::string_view name() const override { return "lane"; }
  /// Needs input in host memory. Also throws Error if act() was not called before the first step of a world's current
  /// episode.
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;
  /// Null for pedestrians, for absent agents, and before the first act().
  const LaneKeepingAgent* agent(size_t slot) const { return agents_[slot].get(); }

 private:
  void begin_episode(const SimulatorArrays& input, size_t world);
  void begin_lives(size_t world);

  std::unique_ptr<SimulatorSetup> setup_;
  std::vector<std::unique_ptr<LaneGraph>> graphs_;         // [maps]
  std::vector<int32_t> episode_;                           // [worlds] episode that agents_ drive, or -1
  std::vector<std::optional<WorldView>> views_;            // [worlds]
  std::vector<std::unique_ptr<LaneKeepingAgent>> agents_;  // [slots]
};

}  // namespace pictura
