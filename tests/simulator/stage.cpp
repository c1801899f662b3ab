#include "pictura/tests/simulator/stage.h"

namespace pictura::testing {

Stage::Stage(std::shared_ptr<const RoadMap> map, int num_agents, const SimulatorConfig& config)
    : worlds(SimulatorSetup(config, {compile_map(std::move(map), map_options(config))}, {}, {{0, num_agents, 0}})),
      results(static_cast<size_t>(num_agents), config) {
  for (int agent = 0; agent < num_agents; ++agent) {
    const auto i = static_cast<size_t>(agent);
    worlds.state.agents.length_m[i] = 4;
    worlds.state.agents.width_m[i] = 2;
    worlds.state.agents.height_m[i] = 1.5f;
    for (int c = 0; c < kNumConditioning; ++c) {
      set(agent, static_cast<Conditioning>(c), c < kNumRewardConditioning ? kPaperConditioning[c].low : 1.0f);
    }
    worlds.state.boxes[i] = worlds.state.boxes_before[i] = box_of(worlds.state.agents.view(), agent);
    // Waypoints are out of all agents' way until a test sets others.
    for (size_t k = 0; k < kNumWaypoints; ++k) worlds.state.agents.waypoint_x_m[i * kNumWaypoints + k] = 1e6f;
  }
  for (LightState& light : worlds.state.lights) light = LightState::green;
  sort_boxes();
}

void Stage::set(int agent, Conditioning which, float value) {
  worlds.state.agents.conditioning[agent * kNumConditioning + static_cast<int>(which)] = value;
}

void Stage::put(int agent, Vec2 position_m, float heading_rad, float speed_mps) {
  const WorldView view = world();
  Motion motion;
  motion.x_m = position_m.x;
  motion.y_m = position_m.y;
  motion.heading_rad = heading_rad;
  motion.speed_mps = speed_mps;
  store_motion(view.agents, agent, motion);
  store_fit(view.agents, agent, fit_lane(view.map, position_m, 0, heading_rad, -1));
  view.agents.status[agent] = AgentStatus::active;
  view.boxes[agent] = view.boxes_before[agent] = box_of(view.agents, agent);
  sort_boxes();
}

void Stage::sort_boxes() {
  // Put all boxes into one list per cell, by brute force.
  CellLists& cells = worlds.box_cells[0];
  const GridView view = cells.view();
  cells.items.clear();
  for (int cell = 0; cell < cells.num_x * cells.num_y; ++cell) {
    cells.begin[cell] = static_cast<int32_t>(cells.items.size());
    for (size_t i = 0; i < worlds.state.boxes.size(); ++i) {
      const Vec3 at = worlds.state.boxes[i].center_m;
      if (worlds.state.boxes[i].drawn && view.cell_y(at.y) * cells.num_x + view.cell_x(at.x) == cell) {
        worlds.cell_centers[cells.items.size()] = at.xy();
        cells.items.push_back(static_cast<int32_t>(i));
      }
    }
  }
  cells.begin.back() = static_cast<int32_t>(cells.items.size());
}

std::vector<float> Stage::step(int32_t action) {
  const WorldView view = world();
  for (int agent = 0; agent < view.num_agents; ++agent) advance(view, agent, action, 1);
  sort_boxes();
  const WorldView sorted = world();
  for (int agent = 0; agent < view.num_agents; ++agent) find_collisions(sorted, agent);
  std::vector<float> rewards;
  for (int agent = 0; agent < view.num_agents; ++agent) rewards.push_back(apply_reward_and_halt(sorted, agent).total());
  return rewards;
}

}  // namespace pictura::testing
