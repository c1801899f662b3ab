// The lane keeper: a controller for vehicles and cyclists among others. It goes where its waypoints lead, stops at red
// lights and behind others, even if those halt at once, and gives way where it changes lanes. It pursues the path of
// its lanes, and where that would leave the road, since long cars cut corners, it follows a plan that does not. Where
// there is none it stops. On the host only.
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

/// Drives one vehicle or cyclist of a world through one life.
class LaneKeepingAgent {
 public:
  /// `world` shows the simulator's agents and lights as they are at every act(), and has not been stepped in this
  /// life yet; the graph is its map's. Its arrays and the graph must outlive this. `search_nodes` are what the slot's
  /// life before left.
  LaneKeepingAgent(const WorldView& world, int agent, const LaneGraph& graph, size_t search_nodes = kMaxSearchNodes);

  /// The action for what the agent and the lights are now.
  int32_t act();
  int32_t life() const { return life_; }
  /// How many nodes its searches may still make.
  size_t search_nodes() const { return search_nodes_; }
  /// Steps in which it waited at a red light.
  int stops() const { return stops_; }
  /// Steps in which its rear axle was more than kAstray_m from its path.
  int steps_astray() const { return steps_astray_; }
  static constexpr float kAstray_m = 1;

 private:
  // A node takes 1 to 4 us. Where roads end an agent's search takes at most 10 ms a step; a few vehicles then find no
  // way round the tightest ends (docs/research/public_maps.md). In towns, where a way may need 130,000 nodes, searches
  // take at most 1 ms a step in the mean of a long run, and .9 s in a single step.
  static constexpr size_t kMaxSearchNodes = 300'000, kMaxSearchNodesOfOpen = 2'000, kSearchNodesPerStep = 500,
                          kMinSearchNodes = 20'000;

  enum class Driving { pursues, brakes, brakes_straight };  // the path; on the path; without steering

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
  bool has_way(int other) const;
  bool is_changing_lane() const;
  bool follows(const AgentBox& other) const;
  const std::vector<PathPoint>& points() const { return path_.points(); }

  const WorldView world_;
  const int self_, slot_;
  const int32_t life_;
  const DrivenAgent agent_;
  std::array<RoutePoint, kNumWaypoints> waypoints_;
  int32_t chain_ = -1;  // whose waypoints these are
  LanePath path_;
  size_t place_ = 0;                           // the point of the path nearest to it
  std::array<size_t, kNumWaypoints> goals_{};  // the points where the waypoints are
  DrivingPlan plan_;
  size_t next_planned_ = 0;  // of its actions
  const size_t max_search_nodes_;
  size_t search_nodes_;
  size_t min_search_nodes_ = 0;  // of these, to begin the next search
  bool halts_ = false;           // before it would leave the road, until it knows a way on
  int stops_ = 0, steps_astray_ = 0;
};

/// Drives all vehicles and cyclists of a simulator; pedestrians stand still.
class LaneKeepingController final : public Controller {
 public:
  /// Of the simulator it reads configuration, maps and worlds, wherever that computes. act() takes host memory.
  explicit LaneKeepingController(const Simulator& simulator);
  ~LaneKeepingController() override;

  std::string_view name() const override { return "lane"; }
  /// Throws Error besides where a world is in the middle of an episode whose first step this has not seen.
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;
  /// Null for pedestrians, for the absent, and before the first act().
  const LaneKeepingAgent* agent(size_t slot) const { return agents_[slot].get(); }

 private:
  void begin_episode(const SimulatorArrays& input, size_t world);
  void begin_lives(size_t world);

  std::unique_ptr<SimulatorSetup> setup_;                  // a copy, for its maps and rule options
  std::vector<std::unique_ptr<LaneGraph>> graphs_;         // [maps]
  std::vector<int32_t> episode_;                           // [worlds] the one that agents_ drive, or -1
  std::vector<std::optional<WorldView>> views_;            // [worlds] of that episode
  std::vector<std::unique_ptr<LaneKeepingAgent>> agents_;  // [slots]
};

}  // namespace pictura
