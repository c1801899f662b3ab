// Runs the phases of the CUDA simulator on the host, with threads in a random order. Threads that interleave within a
// phase, and warps of several lanes, are not tested.
#pragma once

#include <algorithm>
#include <array>
#include <numeric>
#include <random>

#include <gtest/gtest.h>

#include "pictura/backend_cuda/simulator/phases.h"
#include "pictura/simulator/host_worlds.h"

namespace pictura::testing {

struct HostAtomics {
  void set_bits(uint32_t* value, uint32_t bits) const { *value |= bits; }
  int32_t add(int32_t* value, int32_t change) const { return std::exchange(*value, *value + change); }
  int32_t exchange(int32_t* value, int32_t other) const { return std::exchange(*value, other); }
  void lower(int32_t* value, int32_t bound) const { *value = std::min(*value, bound); }
};

/// Calls body(i) for i in [0, count), in a random order.
template <typename Body>
void shuffled(std::mt19937* random, int count, const Body& body) {
  std::vector<int> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), *random);
  for (const int i : order) body(i);
}

/// A group of one lane.
struct HostThreadGroup : SingleThread {
  float* rows = nullptr;
  float* staging() const { return rows; }
  template <typename T>
  T read(const T& value) const {
    return value;
  }
  uint32_t ballot(bool value) const { return value; }
  int count_before(uint32_t) const { return 0; }
  void write(const float* values, int filled, int end, int capacity, float* out) const {
    ASSERT_LE(end, capacity);
    std::copy(values, values + filled, out);
    std::fill(out + filled, out + std::max(filled, end), 0.0f);
  }
};

struct ShuffledTeam : HostAtomics {
  std::mt19937* random;
  cuda::TeamMemory* shared;
  cuda::TeamMemory& memory() const { return *shared; }
  template <typename Body>
  void for_each(int count, const Body& body) const {
    shuffled(random, count, body);
  }
  template <int kGroup, typename Body>
  void for_each_by_groups(int count, const Body& body) const {
    shuffled(random, count, [&body](int i) { body(HostThreadGroup{}, i); });
  }
};

struct ShuffledLaunch {
  std::mt19937* random;
  void copy(void* to, const void* from, size_t size) const { std::memcpy(to, from, size); }
  void fill(void* memory, size_t size, int byte) const { std::memset(memory, byte, size); }
  template <typename Phase>
  void threads(int32_t count, const Phase& phase) const {
    shuffled(random, count, [&phase](int i) { phase(HostAtomics{}, i); });
  }
  template <typename Phase>
  void teams(int32_t count, const Phase& phase) const {
    shuffled(random, count, [this, &phase](int i) {
      if (!phase.has_work(i)) return;
      cuda::TeamMemory memory;
      ShuffledTeam team;
      team.random = random;
      team.shared = &memory;
      phase(team, i);
    });
  }
  template <int kGroup, typename Phase>
  void groups(int32_t count, const Phase& phase) const {
    shuffled(random, count, [&phase](int i) {
      std::array<float, cuda::ObservationWriter::kStaging> rows{};
      HostThreadGroup group;
      group.rows = rows.data();
      phase(group, i);
    });
  }
  template <typename Side, typename Main>
  void fork_join(const Side& side, const Main& main) const {
    const bool is_first = (*random)() % 2 == 0;
    if (is_first) side(*this);
    main();
    if (!is_first) side(*this);
  }
};

/// Steps worlds from episode 0.
class ShuffledExecutor {
 public:
  ShuffledExecutor(const SimulatorConfig& config, const std::vector<std::shared_ptr<const RoadMap>>& maps,
                   std::vector<WorldSpec> worlds, unsigned shuffle_seed)
      : ShuffledExecutor(config, compile_maps(maps, map_options(config)), std::move(worlds), shuffle_seed) {}
  ShuffledExecutor(const SimulatorConfig& config, const CompiledMaps& maps, std::vector<WorldSpec> worlds,
                   unsigned shuffle_seed)
      : host(SimulatorSetup(config, maps, {}, std::move(worlds))),
        results(static_cast<size_t>(host.setup.num_slots()), config),
        random_(shuffle_seed),
        next_agents_(static_cast<size_t>(host.setup.num_slots())),
        next_boxes_(host.state.boxes.size()),
        next_light_plans_(host.state.light_plans.size()),
        next_lights_(host.state.lights.size()),
        next_spawned_(host.setup.worlds.size()),
        cell_items_(host.state.boxes.size()),
        try_boxes_(host.state.boxes.size() * kSpawnTries),
        free_tries_(host.state.boxes.size()),
        known_tries_(host.state.boxes.size()),
        chosen_try_(host.state.boxes.size()),
        next_try_(host.state.boxes.size()),
        chain_first_(host.state.boxes.size()),
        chain_next_(host.state.boxes.size()),
        crowd_begin_(host.state.boxes.size() + host.setup.worlds.size()),
        crowd_items_(host.state.boxes.size()),
        began_(host.setup.worlds.size()),
        prepares_(host.setup.worlds.size()),
        first_element_(static_cast<size_t>(host.setup.num_slots())) {
    std::iota(cell_items_.begin(), cell_items_.end(), 0);
    for (int w = 0; w < host.setup.num_worlds(); ++w) {
      cell_begin_.insert(cell_begin_.end(), {0, host.world(w).num_boxes});
    }
    for (int w = 0; w < host.setup.num_worlds(); ++w) {
      const auto first_box = static_cast<size_t>(host.setup.box_begin[w]);
      const MapRules& rules = host.setup.map_of(w).rules;
      WorldView view = host.world(w);
      const auto first_light = static_cast<size_t>(host.setup.light_begin[w]);
      const auto num_boxes = static_cast<size_t>(view.num_boxes);
      const GridView cells = chain_cells(rules.low_m, rules.high_m, view.num_boxes, kBoxCell_m);
      const bool is_crowd = cuda::is_crowd(view.num_boxes);
      has_crowds_ = has_crowds_ || is_crowd;
      int32_t* const crowd_begin = crowd_begin_.data() + first_box + static_cast<size_t>(w);
      int32_t* const crowd_items = crowd_items_.data() + first_box;
      view.box_cells = is_crowd ? cuda::crowd_cells(cells, crowd_begin, {crowd_items, num_boxes})
                                : cuda::one_cell({cell_begin_.data() + 2 * w, 2}, {cell_items_.data(), num_boxes});
      scratch_.push_back({try_boxes_.data() + first_box * kSpawnTries,
                          free_tries_.data() + first_box,
                          known_tries_.data() + first_box,
                          chosen_try_.data() + first_box,
                          next_try_.data() + first_box,
                          {cells, chain_first_.data() + first_box, chain_next_.data() + first_box},
                          is_crowd ? crowd_begin : nullptr,
                          is_crowd ? crowd_items : nullptr});
      worlds_.push_back(view);
      view.agents = next_agents_.view();
      view.boxes = view.boxes_before = next_boxes_.data() + first_box;
      view.light_plans = next_light_plans_.data() + first_light;
      view.lights = next_lights_.data() + first_light;
      next_worlds_.push_back(view);
    }
    launch_reset(ShuffledLaunch{&random_}, arrays(), nullptr, config.seed);
  }

  void reset(const std::vector<uint8_t>& mask, uint64_t seed) {
    launch_reset(ShuffledLaunch{&random_}, arrays(), mask.data(), seed);
  }
  void set_state(const StateEdit& edit) { launch_edit(ShuffledLaunch{&random_}, arrays(), edit); }
  int64_t faulty_edit() const { return faulty_edit_; }
  void observe(const ObservationQueries& asked) { launch_queries(ShuffledLaunch{&random_}, arrays(), asked); }
  int64_t faulty_query() const { return faulty_query_; }

  template <typename CommandType>
  void step(const std::vector<CommandType>& commands) {
    launch_step(ShuffledLaunch{&random_}, arrays(), commands.data());
  }
  int64_t rejected() const { return rejected_command_; }

  uint64_t hash() const { return host.state.hash(host.setup); }
  std::vector<uint8_t> save() const { return host.state.save(host.setup); }

  HostWorlds host;
  HostResults results;

 private:
  cuda::PhaseArrays arrays() {
    cuda::PhaseArrays arrays;
    arrays.worlds = worlds_.data();
    arrays.next_worlds = next_worlds_.data();
    arrays.scratch = scratch_.data();
    arrays.world_of_slot = host.setup.world_of_slot.data();
    arrays.agents = host.state.agents.view();
    arrays.next_agents = next_agents_.view();
    arrays.num_worlds = host.setup.num_worlds();
    arrays.num_slots = host.setup.num_slots();
    arrays.seed = host.state.seed.data();
    arrays.episode_step = host.state.episode_step.data();
    arrays.episode_index = host.state.episode_index.data();
    arrays.episode_over = host.state.episode_over.data();
    arrays.spawned = host.state.spawned.data();
    arrays.world_totals = host.state.world_totals.data();
    arrays.results = results.step_arrays();
    arrays.views = results.views.data();
    arrays.driver = results.driver.data();
    arrays.observations = results.observation_view();
    arrays.entity_sets = host.setup.config.vector_observations;
    arrays.has_lives = host.setup.has_lives();
    arrays.has_replayed_tracks = host.setup.has_replayed_tracks();
    arrays.has_other_drivers = host.setup.has_other_drivers();
    arrays.parked_per_world = host.setup.config.parked_cars;
    arrays.has_crowds = has_crowds_;
    arrays.began = began_.data();
    arrays.prepares = prepares_.data();
    arrays.next_spawned = next_spawned_.data();
    arrays.rejected_slot = &rejected_slot_;
    arrays.rejected_command = &rejected_command_;
    arrays.first_element = first_element_.data();
    arrays.faulty_element = &wrong_element_;
    arrays.faulty_edit = &faulty_edit_;
    arrays.faulty_query = &faulty_query_;
    return arrays;
  }

  std::mt19937 random_;
  std::vector<WorldView> worlds_, next_worlds_;
  AgentState next_agents_;
  std::vector<AgentBox> next_boxes_;
  std::vector<LightPlan> next_light_plans_;
  std::vector<LightState> next_lights_;
  std::vector<int32_t> next_spawned_;
  std::vector<cuda::WorldScratch> scratch_;
  std::vector<int32_t> cell_begin_, cell_items_;
  std::vector<AgentBox> try_boxes_;
  std::vector<uint32_t> free_tries_;
  std::vector<int32_t> known_tries_, chosen_try_, next_try_;
  std::vector<int32_t> chain_first_, chain_next_, crowd_begin_, crowd_items_;
  bool has_crowds_ = false;
  std::vector<uint8_t> began_, prepares_;
  std::vector<int32_t> first_element_;
  int32_t rejected_slot_ = 0, wrong_element_ = 0;
  int64_t faulty_edit_ = kNoEditFault, faulty_query_ = kNoQueryFault;
  int64_t rejected_command_ = kNoRejection;
};

}  // namespace pictura::testing
