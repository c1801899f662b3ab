// The CPU simulator, which is the reference (oracle) for other simulators. It applies the rules of simulator/rules/
// world by world, on host threads.
#include "pictura/simulator/simulator.h"

#include <algorithm>
#include <array>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/simulator/host_worlds.h"
#include "pictura/simulator/rules/edit_state.h"
#include "pictura/simulator/rules/enter.h"
#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/rules/observe_query.h"
#include "pictura/simulator/rules/spawn.h"

namespace pictura {
namespace {

/// Sorts the boxes that are in the world into cells, by a counting sort. Within a cell, the boxes are in ascending
/// order.
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
    if (!world.boxes[i].drawn) continue;
    const int32_t at = --begin[cell_of(world.boxes[i])];
    cells_inout->items[at] = i;
    world.cell_centers[at] = world.boxes[i].center_m.xy();
  }
}

struct HostSnapshot final : StateSnapshot {
  WorldsToken worlds;
  SimulatorState state;
};

class SimulatorCpu final : public Simulator {
 public:
  explicit SimulatorCpu(SimulatorSetup setup)
      : Simulator("cpu"), worlds_(std::move(setup)), capacity_(worlds_.setup.needs()) {
    parts_ = &worlds_.setup;
    begin();
  }

  void set_worlds(CompiledMaps maps, std::vector<GeometryHandle> handles, std::vector<WorldSpec> worlds, uint64_t seed,
                  Stream) override {
    const SimulatorSetup next = worlds_.setup.with(std::move(maps), std::move(handles), std::move(worlds), seed);
    reserve(next.needs());
    worlds_.assign(next);
    begin();
  }
  void reserve(const SimulatorCapacity& capacity) override {
    if (capacity_.holds(capacity)) return;
    capacity_ = capacity_.joined(capacity);
    worlds_.reserve(capacity_);
    results_.reserve(capacity_.slots, config());
    ++generation_;
    show_arrays();
    for_each_world([this](int w) {
      clear_results(w);  // as on a device
      sort_into_cells(worlds_.world(w), &worlds_.box_cells[w]);
    });
  }

  SpawnReport spawn_report(Stream) const override { return worlds_.state.spawn_report(worlds_.setup); }
  const SimulatorTotals& totals(Stream) const override { return totals_; }
  uint64_t state_hash(Stream) const override { return worlds_.state.hash(worlds_.setup); }

  std::vector<uint8_t> save(Stream) const override { return worlds_.state.save(worlds_.setup); }
  void restore(Span<const uint8_t> bytes, Stream) override {
    worlds_.state.restore(worlds_.setup, bytes);
    publish_restored();
  }
  std::unique_ptr<StateSnapshot> snapshot(Stream) const override {
    auto copy = std::make_unique<HostSnapshot>();
    copy->worlds = worlds_token_;
    copy->state = worlds_.state;
    return copy;
  }
  void restore(const StateSnapshot& snapshot, Stream) override {
    const auto* copy = dynamic_cast<const HostSnapshot*>(&snapshot);
    PICTURA_CHECK(copy && copy->worlds == worlds_token_,
                  "restore: expected a snapshot of these worlds of this simulator");
    worlds_.state = copy->state;  // copied instead of moved, so that arrays keep their memory
    publish_restored();
  }

 private:
  StepResult step_actions(Span<const int32_t> actions, Stream) override { return step_all(actions); }
  StepResult step_commands(Span<const Command> commands, Stream) override { return step_all(commands); }

  void reset_worlds(Span<const uint8_t> world_mask, uint64_t seed, Stream) override {
    for_each_world([this, world_mask, seed](int w) {
      if (world_mask.empty() || world_mask[w]) begin_first_episode(w, seed);
    });
  }

  void apply_edit(const StateEdit& edit, Stream) override {
    std::vector<int32_t> first_element(static_cast<size_t>(num_slots()), edit.count);
    for (int i = edit.count - 1; i >= 0; --i) {
      if (has_slot(edit, i, num_slots())) first_element[edit.slots[i]] = i;
    }
    const auto world_index = [this](int slot) { return worlds_.setup.world_of_slot[slot]; };
    for (int i = 0; i < edit.count; ++i) {
      const int64_t fault = find_edit_fault(edit, i, num_slots(), first_element.data(),
                                            [&](int slot) { return worlds_.world(world_index(slot)); });
      if (fault != kNoEditFault) fail("set_state: {}", edit_fault_text(fault, num_slots()));
    }
    std::vector<uint8_t> is_edited(static_cast<size_t>(worlds_.setup.num_worlds()));
    for (int i = 0; i < edit.count; ++i) {
      const int w = world_index(edit.slots[i]);
      worlds_.state.spawned[w] += pictura::apply_edit(worlds_.world(w), edit, i);
      is_edited[w] = 1;
    }
    for_each_world([this, &is_edited](int w) {
      if (!is_edited[w]) return;
      sort_into_cells(worlds_.world(w), &worlds_.box_cells[w]);
      write_observations(w);
    });
  }

  void answer_queries(const ObservationQueries& asked, Stream) override {
    const auto world_of = [this](int slot) { return worlds_.world(worlds_.setup.world_of_slot[slot]); };
    const auto count = static_cast<int>(asked.queries.size());
    for (int i = 0; i < count; ++i) {
      const int64_t fault = find_query_fault(asked, i, num_slots(), world_of);
      if (fault != kNoQueryFault) fail("observe: {}", query_fault_text(fault, num_slots()));
    }
    parallel_for(config().num_threads, count, [&](int64_t item) {
      const int i = static_cast<int>(item);
      answer_query(world_of(asked.queries[i].slot), asked, i, config().vector_observations);
    });
  }

  void begin_first_episode(int w, uint64_t seed) {
    worlds_.state.seed[w] = seed;
    worlds_.state.episode_index[w] = 0;
    clear_results(w);
    begin_episode(w);
    write_observations(w);
  }

  void begin() {
    worlds_token_ = new_worlds_token();
    results_.resize(worlds_.setup.num_slots(), config());
    chosen_try_.assign(worlds_.setup.num_slots(), -1);
    totals_ = {};
    show_arrays();
    reset();
  }

  void show_arrays() {
    const SimulatorState& state = worlds_.state;
    arrays_ = {.device = {},
               .slots = worlds_.setup.slot_table(),
               .observations = results_.observation_view(),
               .scene = worlds_.scene,
               .driver = results_.driver,
               .views = results_.views,
               .state = worlds_.state.agents.view(),
               .episode_step = state.episode_step,
               .episode_index = state.episode_index,
               .episode_over = state.episode_over,
               .world_totals = state.world_totals,
               .seed = state.seed,
               .results = {.reward = results_.reward,
                           .terminated = results_.terminated,
                           .truncated = results_.truncated,
                           .valid = results_.valid,
                           .refusal = state.agents.refusal,
                           .sums = results_.sums}};
  }

  void publish_restored() {
    totals_ = worlds_.state.totals();
    for_each_world([this](int w) {
      clear_results(w);
      sort_into_cells(worlds_.world(w), &worlds_.box_cells[w]);
      write_observations(w);
    });
  }

  template <typename Body>
  void for_each_world(Body&& body) {
    parallel_for(config().num_threads, worlds_.setup.num_worlds(), [&body](int64_t w) { body(static_cast<int>(w)); });
  }

  template <typename CommandType>
  StepResult step_all(Span<const CommandType> commands) {
    check_commands(commands);
    for_each_world([this, commands](int w) {
      const auto index = static_cast<size_t>(w);
      if (worlds_.state.episode_over[index]) {
        clear_results(w);
        ++worlds_.state.episode_index[index];
        ++worlds_.state.world_totals[index].episodes;
        begin_episode(w);
      } else {
        step_world(w, commands);
      }
      worlds_.state.world_totals[index].slot_steps += worlds_.setup.worlds[index].num_agents;
      write_observations(w);
    });
    totals_ = worlds_.state.totals();
    return arrays_.results;
  }

  /// Checks commands before the step changes anything, so that a refused step leaves the state unchanged.
  template <typename CommandType>
  void check_commands(Span<const CommandType> commands) {
    for (int w = 0; w < worlds_.setup.num_worlds(); ++w) {
      if (worlds_.state.episode_over[w]) continue;
      const WorldView world = worlds_.world(w);
      for (int agent = 0; agent < world.num_agents; ++agent) {
        const int slot = world.first_slot + agent;
        const CommandType& command = commands[slot];
        if (!accepts(world, agent, command)) fail("step: {}", rejection_text(rejected_command(slot, command)));
      }
    }
  }

  void clear_results(int w) {
    const WorldView world = worlds_.world(w);
    for (int agent = 0; agent < world.num_agents; ++agent) {
      clear_result(results_.step_arrays(), world.first_slot + agent);
    }
  }

  void begin_episode(int w) {
    const auto index = static_cast<size_t>(w);
    worlds_.state.episode_step[index] = 0;
    worlds_.state.episode_over[index] = 0;
    const WorldView world = worlds_.world(w);
    for (int light = 0; light < static_cast<int>(world.map.stop_lines.size()); ++light) begin_light(world, light);
    // Until all boxes are placed, the cells hold linked lists of boxes.
    CellLists& cells = worlds_.box_cells[index];
    const BoxChains standing{cells.view(), cells.begin.data(), cells.items.data()};
    std::fill(cells.begin.begin(), cells.begin.end(), -1);
    const auto add = [&world, &standing](int box) {
      if (!world.boxes[box].drawn) return;
      add_box(standing, box, world.boxes[box].center_m.xy(),
              [](int32_t* value, int32_t other) { return std::exchange(*value, other); });
    };
    const int num_parked = world.num_boxes - world.num_agents;
    for (int car = 0; car < num_parked; ++car) {
      if (has_replayed_tracks(world.map)) {
        replay_track(world, car, 0);
        continue;
      }
      put_parked_car(world, car, first_try(!world.map.parking_spots.empty(), [&](int i) {
                       const ParkingSpot& spot = parking_spot(world, car, i);
                       const AgentBox box = parked_box(world, car, spot);
                       return is_clear(world, box, standing) && may_park(world.map, box, spot);
                     }));
      add(world.num_agents + car);
    }
    // All agents choose their places before any agent is placed, because placing sets an agent's height to that of its
    // road.
    for (int agent = 0; agent < world.num_agents; ++agent) {
      draw_agent(world, agent);
      const int chosen = first_try(has_places(world, agent), [&](int i) {
        const AgentBox box = spawn_box(world, agent, i);
        return is_clear(world, box, standing) && may_spawn(world.map, box);
      });
      if (chosen >= 0) world.boxes[agent] = spawn_box(world, agent, chosen);
      world.boxes[agent].drawn = chosen >= 0;
      chosen_try_[world.first_slot + agent] = chosen;
      add(agent);
    }
    int spawned = 0;
    for (int agent = 0; agent < world.num_agents; ++agent) {
      const int chosen = chosen_try_[world.first_slot + agent];
      place_agent(world, agent, chosen);
      spawned += joins_episode(world, agent, chosen);
    }
    worlds_.state.spawned[index] = spawned;
    sort_into_cells(world, &worlds_.box_cells[index]);
  }

  /// Returns the number of the first try that succeeds, or -1 if no try succeeds or there are no places.
  template <typename Succeeds>
  static int first_try(bool has_places, Succeeds&& succeeds) {
    for (int i = 0; has_places && i < kSpawnTries; ++i) {
      if (succeeds(i)) return i;
    }
    return -1;
  }

  template <typename CommandType>
  void step_world(int w, Span<const CommandType> commands) {
    const auto index = static_cast<size_t>(w);
    const WorldView world = worlds_.world(w);
    const StepArrays results = results_.step_arrays();
    const int steps = ++worlds_.state.episode_step[index];

    for (int agent = 0; agent < world.num_agents; ++agent) {
      const auto slot = static_cast<size_t>(world.first_slot + agent);
      results.valid[slot] = is_counted(world, agent, commands[slot]);
      advance(world, agent, commands[slot], steps);
    }
    for (int i = 0; has_replayed_tracks(world.map) && i < world.num_boxes - world.num_agents; ++i) {
      replay_track(world, i, steps);
    }
    sort_into_cells(world, &worlds_.box_cells[index]);
    for (int agent = 0; agent < world.num_agents; ++agent) find_collisions(world, agent);

    std::array<SimulatorTotals, kTotalsBins> bins{};
    const auto bin_of = [&bins](int agent) { return &bins[agent % kTotalsBins]; };
    int active = 0;
    for (int agent = 0; agent < world.num_agents; ++agent) {
      apply_reward_and_halt(world, agent, steps, results);
      count_agent(world, agent, results, bin_of(agent));
      active += keeps_episode(world, agent);
    }
    for (int light = 0; light < static_cast<int>(world.map.stop_lines.size()); ++light) {
      world.lights[light] = light_state(world.map, light, world.light_plans[light], steps);
    }
    const bool ends = episode_ends(world, steps, worlds_.state.spawned[index], active);
    worlds_.state.episode_over[index] = ends;
    for (int agent = 0; agent < world.num_agents; ++agent) finish_agent(world, agent, ends, results, bin_of(agent));
    bool has_entered = false;
    if (!ends) enter_waiting(world, steps, SingleThread{}, [&has_entered](int) { has_entered = true; });
    if (has_entered) sort_into_cells(world, &worlds_.box_cells[index]);
    SimulatorTotals sum;
    for (const SimulatorTotals& bin : bins) sum.add(bin);
    worlds_.state.world_totals[index].add(sum);
  }

  /// Writes the observations of the world's agents and the views of their cameras.
  void write_observations(int w) {
    const WorldView world = worlds_.world(w);
    const ObservationView observations = results_.observation_view();
    for (int agent = 0; agent < world.num_agents; ++agent) {
      results_.views[world.first_slot + agent] = view_of(world, agent, hidden_from(world, agent));
      results_.driver[world.first_slot + agent] = static_cast<uint8_t>(driver_of(driver_kind_of(world, agent)));
    }
    pictura::observe(world, 0, world.num_agents, worlds_.setup.config.vector_observations, observations);
  }

  HostWorlds worlds_;
  SimulatorCapacity capacity_;
  WorldsToken worlds_token_;
  HostResults results_;
  std::vector<int32_t> chosen_try_;  // [slots] used while an episode begins
  SimulatorTotals totals_;
};

}  // namespace

std::unique_ptr<Simulator> make_cpu_simulator(SimulatorSetup setup) {
  return std::make_unique<SimulatorCpu>(std::move(setup));
}

}  // namespace pictura
