// The CUDA executor's phases on a host: every loop over threads runs in a random order, so that what a device may do in
// any order must not matter. What it cannot show are two threads in the middle of one phase, and warps of many lanes.
#pragma once

#include <algorithm>
#include <numeric>
#include <random>

#include "pictura/backend_cuda/simulator_cuda_phases.h"
#include "pictura/simulator/world_batch.h"

namespace pictura::testing {

struct HostAtomics {
  int32_t add(int32_t* value, int32_t change) const { return std::exchange(*value, *value + change); }
  void lower(int32_t* value, int32_t bound) const { *value = std::min(*value, bound); }
  void set_bits(uint32_t* value, uint32_t bits) const { *value |= bits; }
};

/// Calls body(i) for all i in [0, count), in a random order.
template <typename Body>
void shuffled(std::mt19937* random, int count, const Body& body) {
  std::vector<int> order(static_cast<size_t>(count));
  std::iota(order.begin(), order.end(), 0);
  std::shuffle(order.begin(), order.end(), *random);
  for (const int i : order) body(i);
}

struct ShuffledTeam : HostAtomics {
  std::mt19937* random;
  cuda::TeamMemory* shared;
  cuda::TeamMemory& memory() const { return *shared; }
  template <typename Body>
  void for_each(int count, const Body& body) const {
    shuffled(random, count, body);
  }
};

/// A warp of one.
struct OneLane {
  int size() const { return 1; }
  int rank() const { return 0; }
  uint32_t ballot(bool value) const { return value; }
  int count(uint32_t lanes) const { return static_cast<int>(lanes); }
  int count_before(uint32_t) const { return 0; }
  void wait() const {}
};

struct ShuffledLaunch {
  std::mt19937* random;
  void fill(void* memory, size_t size, int byte) const { std::memset(memory, byte, size); }
  template <typename Phase>
  void threads(int32_t count, const Phase& phase) const {
    shuffled(random, count, [&phase](int i) { phase(HostAtomics{}, i); });
  }
  template <typename Phase>
  void teams(int32_t count, const Phase& phase) const {
    shuffled(random, count, [this, &phase](int i) {
      cuda::TeamMemory memory;
      ShuffledTeam team;
      team.random = random;
      team.shared = &memory;
      phase(team, i);
    });
  }
  template <typename Phase>
  void warps(int32_t count, const Phase& phase) const {
    shuffled(random, count, [&phase](int i) { phase(OneLane{}, i); });
  }
};

/// Steps worlds by the phases, from episode 0.
class ShuffledExecutor {
 public:
  ShuffledExecutor(const SimulatorConfig& config, std::vector<std::shared_ptr<const RoadMap>> maps,
                   std::vector<WorldSpec> worlds, unsigned shuffle_seed)
      : batch(config, std::move(maps), std::move(worlds)),
        results(static_cast<size_t>(batch.num_slots()), config),
        random_(shuffle_seed),
        cell_items_(batch.boxes.size()),
        chosen_try_(batch.boxes.size()),
        next_try_(batch.boxes.size()),
        free_tries_(batch.boxes.size()),
        begins_(batch.worlds.size()) {
    for (int w = 0; w < batch.num_worlds(); ++w) {
      const auto first_box = static_cast<size_t>(batch.box_begin[static_cast<size_t>(w)]);
      WorldView view = batch.world(w);
      cell_begin_.emplace_back(view.box_cells.begin.size());
      view.box_cells.begin = cell_begin_.back();
      view.box_cells.items = {cell_items_.data() + first_box, static_cast<size_t>(view.num_boxes)};
      scratch_.push_back({cell_begin_.back().data(), cell_items_.data() + first_box, free_tries_.data() + first_box,
                          chosen_try_.data() + first_box, next_try_.data() + first_box});
      worlds_.push_back(view);
      world_of_slot_.insert(world_of_slot_.end(), static_cast<size_t>(view.num_agents), w);
    }
    launch_reset(ShuffledLaunch{&random_}, arrays());
  }

  void step(Span<const int32_t> actions) { launch_step(ShuffledLaunch{&random_}, arrays(), actions.data()); }
  int64_t refused() const { return refusal_; }

  WorldBatch batch;
  HostResults results;

 private:
  cuda::SimulatorArrays arrays() {
    cuda::SimulatorArrays arrays;
    arrays.worlds = worlds_.data();
    arrays.scratch = scratch_.data();
    arrays.world_of_slot = world_of_slot_.data();
    arrays.num_worlds = batch.num_worlds();
    arrays.num_slots = batch.num_slots();
    arrays.episode_step = batch.episode_step.data();
    arrays.episode_index = batch.episode_index.data();
    arrays.episode_over = batch.episode_over.data();
    arrays.spawned = batch.spawned.data();
    arrays.world_totals = batch.world_totals.data();
    arrays.results = results.step_arrays();
    arrays.views = results.views.data();
    arrays.observations = results.observation_view();
    arrays.entity_sets = batch.config.vector_observations;
    arrays.begins = begins_.data();
    arrays.refused_slot = &refused_slot_;
    arrays.refusal = &refusal_;
    return arrays;
  }

  std::mt19937 random_;
  std::vector<WorldView> worlds_;
  std::vector<cuda::WorldScratch> scratch_;
  std::vector<int32_t> world_of_slot_;
  std::vector<std::vector<int32_t>> cell_begin_;
  std::vector<int32_t> cell_items_, chosen_try_, next_try_;
  std::vector<uint32_t> free_tries_;
  std::vector<uint8_t> begins_;
  int32_t refused_slot_ = 0;
  int64_t refusal_ = -1;
};

}  // namespace pictura::testing
