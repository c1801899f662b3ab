// The simulator's device memory. Arrays have the length of the simulator's capacity, so that set_worlds() allocates
// nothing within this capacity. Copies are asynchronous on a stream.
#pragma once

#include <algorithm>
#include <memory>
#include <type_traits>
#include <vector>

#include "pictura/backend_cuda/simulator/kernels.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/simulator/simulator_state.h"

namespace pictura {

/// The caller may reuse `host` after the call.
template <typename T>
void put(const std::vector<T>& host, const DeviceBuffer<T>& device, cudaStream_t stream) {
  if (host.empty()) return;
  PICTURA_CUDA(cudaMemcpyAsync(device.data(), host.data(), host.size() * sizeof(T), cudaMemcpyHostToDevice, stream));
}
/// Copies as many elements as fit. They are valid after a wait for the stream.
template <typename T>
void get(const DeviceBuffer<T>& device, std::vector<T>* host_out, cudaStream_t stream) {
  if (host_out->empty()) return;
  PICTURA_CUDA(
      cudaMemcpyAsync(host_out->data(), device.data(), host_out->size() * sizeof(T), cudaMemcpyDeviceToHost, stream));
}
/// Copies as many elements as fit into both buffers.
template <typename T>
void copy(const DeviceBuffer<T>& from, const DeviceBuffer<T>& to, cudaStream_t stream) {
  const size_t count = std::min(from.size(), to.size());
  if (count == 0) return;
  PICTURA_CUDA(cudaMemcpyAsync(to.data(), from.data(), count * sizeof(T), cudaMemcpyDeviceToDevice, stream));
}

/// Fields of AgentState.
struct DeviceAgents {
#define X(name, type, per_agent, first, comment) DeviceBuffer<type> name;
  PICTURA_AGENT_FIELDS(X)
#undef X

  DeviceAgents() = default;
  explicit DeviceAgents(size_t num_agents){
#define X(name, type, per_agent, first, comment) name = DeviceBuffer<type>(num_agents * (per_agent));
      PICTURA_AGENT_FIELDS(X)
#undef X
  } AgentStateView view() const {
#define X(name, type, per_agent, first, comment) .name = name.data(),
    return {PICTURA_AGENT_FIELDS(X)};
#undef X
  }
  void put_from(const AgentState& host, cudaStream_t stream) const {
#define X(name, type, per_agent, first, comment) put(host.name, name, stream);
    PICTURA_AGENT_FIELDS(X)
#undef X
  }
  void get_to(AgentState* host_out, cudaStream_t stream) const {
#define X(name, type, per_agent, first, comment) get(name, &host_out->name, stream);
    PICTURA_AGENT_FIELDS(X)
#undef X
  }
  void copy_to(const DeviceAgents& other, cudaStream_t stream) const {
#define X(name, type, per_agent, first, comment) copy(name, other.name, stream);
    PICTURA_AGENT_FIELDS(X)
#undef X
  }
};

/// Arrays of SimulatorState.
struct DeviceState {
  DeviceAgents agents;
  DeviceBuffer<AgentBox> boxes, boxes_before;
  DeviceBuffer<LightPlan> light_plans;
  DeviceBuffer<LightState> lights;
  DeviceBuffer<uint64_t> seed;
  DeviceBuffer<int32_t> episode_step, episode_index;
  DeviceBuffer<uint8_t> episode_over;
  DeviceBuffer<int32_t> spawned;
  DeviceBuffer<SimulatorTotals> world_totals;

  DeviceState() = default;
  DeviceState(size_t num_slots, size_t num_boxes, size_t num_lights, size_t num_worlds)
      : agents(num_slots),
        boxes(num_boxes),
        boxes_before(num_boxes),
        light_plans(num_lights),
        lights(num_lights),
        seed(num_worlds),
        episode_step(num_worlds),
        episode_index(num_worlds),
        episode_over(num_worlds),
        spawned(num_worlds),
        world_totals(num_worlds) {}

  void put_from(const SimulatorState& host, cudaStream_t stream) const {
    agents.put_from(host.agents, stream);
    SimulatorState::visit_arrays(host, *this, [stream](const auto& from, const auto& to) { put(from, to, stream); });
  }
  void get_to(SimulatorState* host_out, cudaStream_t stream) const {
    agents.get_to(&host_out->agents, stream);
    SimulatorState::visit_arrays(*this, *host_out, [stream](const auto& from, auto& to) { get(from, &to, stream); });
  }
  /// Copies as many elements as fit into both: a snapshot may be smaller than the simulator's state.
  void copy_to(const DeviceState& other, cudaStream_t stream) const {
    agents.copy_to(other.agents, stream);
    SimulatorState::visit_arrays(*this, other, [stream](const auto& from, const auto& to) { copy(from, to, stream); });
  }
};

/// Arrays of several maps.
class DeviceMaps {
 public:
  DeviceMaps() = default;
  DeviceMaps(size_t num_maps, size_t num_bytes) : memory_(num_bytes), views_(num_maps) {}

  /// Loads missing maps. Unused maps stay while there is memory for all.
  void load(const CompiledMaps& maps, cudaStream_t stream) {
    size_t missing = 0, missing_bytes = 0;
    for (const auto& map : maps) {
      if (find(map) < maps_.size()) continue;
      ++missing;
      missing_bytes += static_cast<size_t>(map->rules.size_bytes());
    }
    if (maps_.size() + missing > views_.size() || used_bytes_ + missing_bytes > memory_.size()) {
      maps_.clear();
      used_bytes_ = 0;
    }
    for (const auto& map : maps) {
      if (find(map) == maps_.size()) append(map, stream);
    }
  }
  /// Returns a loaded map's view, in device memory.
  const MapView& view(const std::shared_ptr<const CompiledMap>& map) const { return views_.data()[find(map)]; }

 private:
  size_t find(const std::shared_ptr<const CompiledMap>& map) const {
    size_t index = 0;
    while (index < maps_.size() && maps_[index] != map) ++index;
    return index;
  }
  void append(const std::shared_ptr<const CompiledMap>& map, cudaStream_t stream) {
    MapView view = map->rules.view();
    visit_arrays(&view, [this, stream](auto* span) {
      using Element = std::remove_const_t<std::remove_reference_t<decltype((*span)[0])>>;
      const size_t bytes = span->size() * sizeof(Element);
      uint8_t* const at = memory_.data() + used_bytes_;
      if (bytes > 0) PICTURA_CUDA(cudaMemcpyAsync(at, span->data(), bytes, cudaMemcpyHostToDevice, stream));
      *span = {reinterpret_cast<Element*>(at), span->size()};
      used_bytes_ += (bytes + kMapAlignment_bytes - 1) / kMapAlignment_bytes * kMapAlignment_bytes;
    });
    PICTURA_CUDA(cudaMemcpyAsync(views_.data() + maps_.size(), &view, sizeof(view), cudaMemcpyHostToDevice, stream));
    maps_.push_back(map);
  }

  DeviceBuffer<uint8_t> memory_;
  DeviceBuffer<MapView> views_;
  CompiledMaps maps_;  // [loaded] in the order of views_
  size_t used_bytes_ = 0;
};

/// Arrays of SimulatorSetup.
struct DeviceSetup {
  DeviceBuffer<int32_t> slot_begin, box_begin, light_begin, world_of_slot, agent_of_slot;
  DeviceBuffer<uint32_t> global_world;
  DeviceBuffer<GeometryHandle> geometry;

  DeviceSetup() = default;
  DeviceSetup(size_t num_slots, size_t num_worlds)
      : slot_begin(num_worlds + 1),
        box_begin(num_worlds + 1),
        light_begin(num_worlds + 1),
        world_of_slot(num_slots),
        agent_of_slot(num_slots),
        global_world(num_worlds),
        geometry(num_worlds) {}

  void put_from(const SimulatorSetup& host, cudaStream_t stream) const {
    put(host.slot_begin, slot_begin, stream);
    put(host.box_begin, box_begin, stream);
    put(host.light_begin, light_begin, stream);
    put(host.world_of_slot, world_of_slot, stream);
    put(host.agent_of_slot, agent_of_slot, stream);
    put(host.global_world, global_world, stream);
    put(host.geometry, geometry, stream);
  }
};

struct DeviceResults {
  DeviceBuffer<float> reward;
  DeviceBuffer<uint8_t> terminated, truncated, valid, driver;
  DeviceBuffer<StepSums> sums;
  DeviceBuffer<View> views;
#define X(name, type, rows, features, part, comment) DeviceBuffer<type> name;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X

  DeviceResults() = default;
  DeviceResults(size_t num_slots, const SimulatorConfig& config)
      : reward(num_slots),
        terminated(num_slots),
        truncated(num_slots),
        valid(num_slots),
        driver(num_slots),
        sums(num_slots),
        views(num_slots) {
#define X(name, type, rows, features, part, comment) \
  if (config.observes(part)) name = DeviceBuffer<type>(num_slots * (rows) * (features));
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  }
  /// Sets all rows to zero, because later writes clear only the rows that the previous write filled.
  void clear(cudaStream_t stream) const {
    const auto clear_one = [stream](const auto& buffer) {
      if (buffer.size() == 0) return;
      PICTURA_CUDA(cudaMemsetAsync(buffer.data(), 0, buffer.size() * sizeof(*buffer.data()), stream));
    };
    clear_one(reward);
    clear_one(sums);
    for (const DeviceBuffer<uint8_t>* flags : {&terminated, &truncated, &valid}) clear_one(*flags);
#define X(name, type, rows, features, part, comment) clear_one(name);
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  }
  StepArrays step_arrays() const {
    return {.reward = reward.data(),
            .terminated = terminated.data(),
            .truncated = truncated.data(),
            .valid = valid.data(),
            .sums = sums.data()};
  }
  ObservationView observations(size_t num_slots, const SimulatorConfig& config) const {
#define X(name, type, rows, features, part, comment) \
  .name = {name.data(), config.observes(part) ? num_slots * (rows) * (features) : 0},
    return {PICTURA_OBSERVATION_ARRAYS(X)};
#undef X
  }
};

/// Memory of the phases, except state and results.
struct DeviceScratch {
  DeviceBuffer<RuleOptions> options;
  DeviceBuffer<WorldView> worlds, next_worlds;
  DeviceBuffer<cuda::WorldScratch> of_worlds;
  DeviceBuffer<int32_t> cell_begin, cell_items;  // one cell per world, with all its boxes
  DeviceBuffer<Vec2> cell_centers;
  DeviceBuffer<AgentBox> try_boxes;
  DeviceBuffer<uint32_t> free_tries;
  DeviceBuffer<int32_t> known_tries, chosen_try, next_try;
  DeviceBuffer<int32_t> chain_first, chain_next, crowd_begin, crowd_items;
  DeviceBuffer<uint8_t> began, prepares;
  DeviceBuffer<int32_t> rejected_slot, first_element, faulty_element;
  DeviceAgents next_agents;
  DeviceBuffer<AgentBox> next_boxes;
  DeviceBuffer<LightPlan> next_light_plans;
  DeviceBuffer<LightState> next_lights;
  DeviceBuffer<int32_t> next_spawned;

  DeviceScratch() = default;
  DeviceScratch(size_t num_slots, size_t num_boxes, size_t num_lights, size_t num_worlds)
      : options(1),
        worlds(num_worlds),
        next_worlds(num_worlds),
        of_worlds(num_worlds),
        cell_begin(2 * num_worlds),
        cell_items(num_boxes),
        cell_centers(num_boxes),
        try_boxes(num_boxes * kSpawnTries),
        free_tries(num_boxes),
        known_tries(num_boxes),
        chosen_try(num_boxes),
        next_try(num_boxes),
        chain_first(num_boxes),
        chain_next(num_boxes),
        crowd_begin(num_boxes + num_worlds),
        crowd_items(num_boxes),
        began(num_worlds),
        prepares(num_worlds),
        rejected_slot(1),
        first_element(num_slots),
        faulty_element(1),
        next_agents(num_slots),
        next_boxes(num_boxes),
        next_light_plans(num_lights),
        next_lights(num_lights),
        next_spawned(num_worlds) {}
};

/// A stream parallel to the caller's stream, and events that order both.
class SideStream {
 public:
  SideStream() {
    // Higher priority, because all other work waits for it.
    int lowest = 0, highest = 0;
    PICTURA_CUDA(cudaDeviceGetStreamPriorityRange(&lowest, &highest));
    cudaStream_t side = nullptr;
    PICTURA_CUDA(cudaStreamCreateWithPriority(&side, cudaStreamNonBlocking, highest));
    side_.reset(side);
    for (Event* event : {&forked_, &joined_}) {
      cudaEvent_t made = nullptr;
      PICTURA_CUDA(cudaEventCreateWithFlags(&made, cudaEventDisableTiming));
      event->reset(made);
    }
  }
  cuda::StepStreams streams_from(cudaStream_t stream) const {
    return {stream, side_.get(), forked_.get(), joined_.get(), may_begin_early_};
  }

 private:
  struct Destroy {
    void operator()(cudaStream_t stream) const { cudaStreamDestroy(stream); }
    void operator()(cudaEvent_t event) const { cudaEventDestroy(event); }
  };
  using Event = std::unique_ptr<std::remove_pointer_t<cudaEvent_t>, Destroy>;
  std::unique_ptr<std::remove_pointer_t<cudaStream_t>, Destroy> side_;
  Event forked_, joined_;
  const bool may_begin_early_ = cuda::may_begin_early();
};

}  // namespace pictura
