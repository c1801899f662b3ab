// The simulator's oracle: the rules of simulator/rules/ run world by world on host threads.
#include <algorithm>

#include "pictura/common/error.h"
#include "pictura/common/parallel_for.h"
#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/rules/observe.h"
#include "pictura/simulator/rules/spawn.h"
#include "pictura/simulator/rules/step.h"
#include "pictura/simulator/simulator.h"
#include "pictura/simulator/world_batch.h"

namespace pictura {
namespace {

/// Sorts the boxes that stand anywhere into their cells, by counting; within a cell in ascending order.
void sort_into_cells(const WorldView& world, CellLists* cells_inout) {
  std::vector<int32_t>& begin = cells_inout->begin;
  const GridView cells = cells_inout->view();
  const auto cell_of = [&](const AgentBox& box) {
    return static_cast<size_t>(cells.cell_y(box.center_m.y) * cells.num_x + cells.cell_x(box.center_m.x));
  };
  std::fill(begin.begin(), begin.end(), 0);
  for (int i = 0; i < world.num_boxes; ++i) {
    if (world.boxes[i].drawn) ++begin[cell_of(world.boxes[i])];
  }
  int32_t sum = 0;
  for (int32_t& count : begin) count = sum += count;  // the end of each cell, for now
  for (int i = world.num_boxes - 1; i >= 0; --i) {
    if (world.boxes[i].drawn) cells_inout->items[static_cast<size_t>(--begin[cell_of(world.boxes[i])])] = i;
  }
}

void count_events(int events, SimulatorTotals* totals_inout) {
  totals_inout->goals_reached += (events & kEventMetricGoal) != 0;
  totals_inout->waypoints_reached += (events & (kEventWaypoint | kEventGoal)) != 0;
  totals_inout->collisions += (events & kEventCollision) != 0;
  totals_inout->at_fault_collisions += (events & kEventAtFault) != 0;
  totals_inout->off_road += (events & kEventOffRoad) != 0;
  totals_inout->red_light += (events & kEventRedLight) != 0;
  totals_inout->wall_contacts += (events & kEventWall) != 0;
}

SimulatorTotals sum_of(const std::vector<SimulatorTotals>& parts) {
  SimulatorTotals sum;
  for (const SimulatorTotals& part : parts) {
    sum.agent_steps += part.agent_steps;
    sum.slot_steps += part.slot_steps;
    sum.episodes += part.episodes;
    sum.goals_reached += part.goals_reached;
    sum.waypoints_reached += part.waypoints_reached;
    sum.collisions += part.collisions;
    sum.at_fault_collisions += part.at_fault_collisions;
    sum.off_road += part.off_road;
    sum.red_light += part.red_light;
    sum.wall_contacts += part.wall_contacts;
    sum.distance_m += part.distance_m;
    sum.reward += part.reward;
    sum.finished_agent_episodes += part.finished_agent_episodes;
    sum.finished_return += part.finished_return;
  }
  return sum;
}

class SimulatorCpu final : public Simulator {
 public:
  SimulatorCpu(const SimulatorConfig& config, std::vector<std::shared_ptr<const RoadMap>> maps,
               std::vector<WorldSpec> worlds)
      : batch_(config, std::move(maps), std::move(worlds)) {
    reset();
  }

  std::string_view name() const override { return "cpu"; }
  MemorySpace space() const override { return MemorySpace::host; }
  const SimulatorConfig& config() const override { return batch_.config; }
  const std::vector<std::shared_ptr<const RoadMap>>& maps() const override { return batch_.maps; }
  const std::vector<WorldSpec>& worlds() const override { return batch_.worlds; }
  int num_slots() const override { return batch_.num_slots(); }

  void reset() override {
    for_each_world([this](int w) {
      batch_.episode_index[static_cast<size_t>(w)] = 0;
      begin_episode(w);
      show(w);
    });
  }

  StepResult step(Span<const int32_t> actions) override {
    check_actions(actions);
    for_each_world([this, actions](int w) {
      const auto index = static_cast<size_t>(w);
      if (batch_.episode_over[index]) {
        clear_result(w);
        ++batch_.episode_index[index];
        ++batch_.world_totals[index].episodes;
        begin_episode(w);
      } else {
        step_world(w, actions);
      }
      batch_.world_totals[index].slot_steps += batch_.worlds[index].num_agents;
      show(w);
    });
    totals_ = sum_of(batch_.world_totals);
    return {batch_.reward, batch_.terminated, batch_.truncated, batch_.valid};
  }

  ObservationView observations() override { return batch_.observation_view(); }
  const SceneBatch& scene() override { return batch_.scene; }
  Span<const View> views() override { return batch_.views; }
  std::vector<StaticGeometry> geometries() const override {
    std::vector<StaticGeometry> geometries;
    const MapGeometryOptions options{.walls = batch_.config.walls, .wall_seed = batch_.config.wall_seed};
    for (const auto& map : batch_.maps) geometries.push_back(make_static_geometry(*map, options));
    return geometries;
  }

  AgentStateView state() override { return batch_.agents.view(); }
  SpawnReport spawn_report() const override {
    SpawnReport report;
    report.asked = batch_.num_slots();
    for (const int32_t spawned : batch_.spawned) report.spawned += spawned;
    report.refused = report.asked - report.spawned;
    report.parked_asked = int64_t{batch_.num_worlds()} * batch_.config.parked_cars;
    for (int w = 0; w < batch_.num_worlds(); ++w) {
      const auto index = static_cast<size_t>(w);
      const auto begin = batch_.boxes.begin() + batch_.box_begin[index] + batch_.worlds[index].num_agents;
      report.parked_placed += std::count_if(begin, batch_.boxes.begin() + batch_.box_begin[index + 1],
                                            [](const AgentBox& box) { return box.drawn != 0; });
    }
    return report;
  }
  const SimulatorTotals& totals() const override { return totals_; }
  Span<const int32_t> episode_step() const override { return batch_.episode_step; }
  Span<const int32_t> episode_index() const override { return batch_.episode_index; }
  uint64_t state_hash() const override { return batch_.state_hash(); }

  std::vector<uint8_t> save() const override { return batch_.save(); }
  void restore(Span<const uint8_t> bytes) override {
    batch_.restore(bytes);
    totals_ = sum_of(batch_.world_totals);
    for_each_world([this](int w) {
      clear_result(w);
      sort_into_cells(batch_.world(w), &batch_.box_cells[static_cast<size_t>(w)]);
      show(w);
    });
  }

 private:
  template <typename Body>
  void for_each_world(Body&& body) {
    parallel_for(batch_.config.num_threads, batch_.num_worlds(), [&body](int64_t w) { body(static_cast<int>(w)); });
  }

  /// Before anything changes, so that a refused step leaves the state as it was.
  void check_actions(Span<const int32_t> actions) const {
    PICTURA_CHECK(actions.size() == static_cast<size_t>(num_slots()), "step: expected {} actions, got {}", num_slots(),
                  actions.size());
    for (int w = 0; w < batch_.num_worlds(); ++w) {
      const auto index = static_cast<size_t>(w);
      if (batch_.episode_over[index]) continue;
      for (auto slot = static_cast<size_t>(batch_.slot_begin[index]);
           slot < static_cast<size_t>(batch_.slot_begin[index + 1]); ++slot) {
        const bool is_ignored = batch_.agents.status[slot] != static_cast<uint8_t>(AgentStatus::active);
        PICTURA_CHECK(is_ignored || (actions[slot] >= 0 && actions[slot] < kNumActions),
                      "step: slot {}: expected an action in [0, {}), got {}", slot, kNumActions, actions[slot]);
      }
    }
  }

  void clear_result(int w) {
    const auto begin = static_cast<size_t>(batch_.slot_begin[static_cast<size_t>(w)]);
    const auto end = static_cast<size_t>(batch_.slot_begin[static_cast<size_t>(w) + 1]);
    for (size_t slot = begin; slot < end; ++slot) {
      batch_.reward[slot] = 0;
      batch_.terminated[slot] = batch_.truncated[slot] = batch_.valid[slot] = 0;
    }
  }

  void begin_episode(int w) {
    const auto index = static_cast<size_t>(w);
    batch_.episode_step[index] = 0;
    batch_.episode_over[index] = 0;
    const WorldView world = batch_.world(w);
    for (size_t light = 0; light < world.map.stop_lines.size(); ++light) {
      world.light_plans[light] =
          draw_light_plan(world.map.stop_lines[light], static_cast<int32_t>(light), world.options.fixed_lights,
                          world.options.dt_s, world.seed, world.global_world, world.episode);
      world.lights[light] = light_state(world.light_plans[light], 0);
    }
    for (int car = 0; car < world.num_boxes - world.num_agents; ++car) place_parked_car(world, car);
    int spawned = 0;
    for (int agent = 0; agent < world.num_agents; ++agent) {
      draw_agent(world, agent);
      spawned += place_agent(world, agent);
    }
    batch_.spawned[index] = spawned;
    sort_into_cells(world, &batch_.box_cells[index]);
  }

  void step_world(int w, Span<const int32_t> actions) {
    const auto index = static_cast<size_t>(w);
    const WorldView world = batch_.world(w);
    SimulatorTotals& totals = batch_.world_totals[index];
    const int steps = ++batch_.episode_step[index];

    for (int agent = 0; agent < world.num_agents; ++agent) {
      const auto slot = static_cast<size_t>(world.first_slot + agent);
      batch_.valid[slot] = is_active(world, agent);
      advance(world, agent, actions[slot]);
    }
    sort_into_cells(world, &batch_.box_cells[index]);
    for (int agent = 0; agent < world.num_agents; ++agent) find_collisions(world, agent);
    int active = 0;
    for (int agent = 0; agent < world.num_agents; ++agent) {
      const auto slot = static_cast<size_t>(world.first_slot + agent);
      const float speed_mps = world.agents.speed_mps[slot];
      batch_.reward[slot] = settle(world, agent);
      const bool drives = is_active(world, agent);
      batch_.terminated[slot] = batch_.valid[slot] && !drives;
      batch_.truncated[slot] = 0;
      active += drives;
      if (!batch_.valid[slot]) continue;
      ++totals.agent_steps;
      totals.reward += batch_.reward[slot];
      totals.distance_m += driven_m(speed_mps, world.options.dt_s);
      count_events(world.agents.events[slot], &totals);
    }
    for (size_t light = 0; light < world.map.stop_lines.size(); ++light) {
      world.lights[light] = light_state(world.light_plans[light], steps);
    }

    const bool ends = episode_ends(world.options, steps, batch_.spawned[index], active);
    batch_.episode_over[index] = ends;
    for (int agent = 0; agent < world.num_agents; ++agent) {
      const auto slot = static_cast<size_t>(world.first_slot + agent);
      batch_.truncated[slot] = ends && is_active(world, agent);
      if (!batch_.terminated[slot] && !batch_.truncated[slot]) continue;
      ++totals.finished_agent_episodes;
      totals.finished_return += world.agents.episode_return[slot];
    }
  }

  /// Writes what the world's agents observe and where their cameras stand.
  void show(int w) {
    const WorldView world = batch_.world(w);
    const ObservationView observations = batch_.observation_view();
    for (int agent = 0; agent < world.num_agents; ++agent) {
      observe(world, agent, batch_.config.vector_observations, observations);
      const int slot = world.first_slot + agent;
      View view;
      view.world = w;
      if (world.boxes[agent].drawn) {
        view.ego_agent = batch_.box_begin[static_cast<size_t>(w)] + agent;
        view.origin_m = {world.agents.x_m[slot], world.agents.y_m[slot], world.agents.z_m[slot]};
        view.cos_heading = world.agents.cos_heading[slot];
        view.sin_heading = world.agents.sin_heading[slot];
        view.body_length_m = world.agents.length_m[slot];
      }
      batch_.views[static_cast<size_t>(slot)] = view;
    }
  }

  WorldBatch batch_;
  SimulatorTotals totals_;
};

}  // namespace

std::unique_ptr<Simulator> make_cpu_simulator(const SimulatorConfig& config,
                                              std::vector<std::shared_ptr<const RoadMap>> maps,
                                              std::vector<WorldSpec> worlds) {
  return std::make_unique<SimulatorCpu>(config, std::move(maps), std::move(worlds));
}

}  // namespace pictura
