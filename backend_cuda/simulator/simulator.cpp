// The simulator in device memory: WorldBatch checks, describes and saves it on the host, kernels step its copy. Nothing
// here waits for the device but what copies to or from the host.
#include "pictura/simulator/simulator.h"

#include <memory>
#include <numeric>
#include <type_traits>

#include "pictura/backend_cuda/simulator/kernels.h"
#include "pictura/common/cuda/check.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/error.h"
#include "pictura/simulator/world_batch.h"

namespace pictura {

std::unique_ptr<Simulator> make_cuda_simulator(const SimulatorConfig& config,
                                               std::vector<std::shared_ptr<const RoadMap>> maps,
                                               std::vector<WorldSpec> worlds);

namespace {

/// The agents' fields, by their names.
struct DeviceAgents {
#define X(name, type, per_agent, first, comment) DeviceBuffer<type> name;
  PICTURA_AGENT_FIELDS(X)
#undef X

  explicit DeviceAgents(size_t num_agents){
#define X(name, type, per_agent, first, comment) name = DeviceBuffer<type>(num_agents * (per_agent));
      PICTURA_AGENT_FIELDS(X)
#undef X
  } AgentStateView view() const {
#define X(name, type, per_agent, first, comment) name.data(),
    return {PICTURA_AGENT_FIELDS(X)};
#undef X
  }
  void copy_from(const AgentState& host) {
#define X(name, type, per_agent, first, comment) name.copy_from_host(host.name.data());
    PICTURA_AGENT_FIELDS(X)
#undef X
  }
  void copy_to(AgentState* host_out) const {
#define X(name, type, per_agent, first, comment) name.copy_to_host(host_out->name.data());
    PICTURA_AGENT_FIELDS(X)
#undef X
  }
};

/// The rest of the state, by the names of WorldBatch.
struct DeviceState {
  DeviceBuffer<AgentBox> boxes, boxes_before;
  DeviceBuffer<LightPlan> light_plans;
  DeviceBuffer<LightState> lights;
  DeviceBuffer<int32_t> episode_step, episode_index;
  DeviceBuffer<uint8_t> episode_over;
  DeviceBuffer<int32_t> spawned;
  DeviceBuffer<SimulatorTotals> world_totals;
};

/// A SlotTable's arrays.
struct DeviceSlots {
  DeviceBuffer<int32_t> world_of_slot, agent_of_slot, slot_begin;
  DeviceBuffer<uint32_t> global_world;

  SlotTable table() const {
    return {world_of_slot.span(), agent_of_slot.span(), slot_begin.span(), global_world.span()};
  }
};

/// A map's arrays.
class DeviceMap {
 public:
  explicit DeviceMap(const MapView& host) : view_(host) {
    visit_arrays(&view_, [this](auto* span) {
      using Element = std::remove_reference_t<decltype((*span)[0])>;
      buffers_.emplace_back(
          Span<const uint8_t>(reinterpret_cast<const uint8_t*>(span->data()), span->size() * sizeof(Element)));
      *span = {reinterpret_cast<Element*>(buffers_.back().data()), span->size()};
    });
    in_device_ = DeviceBuffer<MapView>(Span<const MapView>(&view_, 1));
  }
  /// In device memory.
  const MapView& view() const { return *in_device_.data(); }

 private:
  MapView view_;
  std::vector<DeviceBuffer<uint8_t>> buffers_;
  DeviceBuffer<MapView> in_device_;
};

struct DeviceResults {
  DeviceBuffer<float> reward;
  DeviceBuffer<uint8_t> terminated, truncated, valid;
  DeviceBuffer<View> views;
#define X(name, type, per_slot, part, comment) DeviceBuffer<type> name;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X

  DeviceResults(size_t slots, const SimulatorConfig& config)
      : reward(slots), terminated(slots), truncated(slots), valid(slots), views(slots) {
    // Zeroed, since of a set's rows only those up to its last count are zeroed later.
#define X(name, type, per_slot, part, comment)                                                 \
  if (config.observes(part)) name = DeviceBuffer<type>(slots * static_cast<size_t>(per_slot)); \
  name.fill(0);
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    clear();
  }
  void clear() {
    reward.fill(0);
    for (DeviceBuffer<uint8_t>* flags : {&terminated, &truncated, &valid}) flags->fill(0);
  }
  StepArrays step_arrays() const { return {reward.data(), terminated.data(), truncated.data(), valid.data()}; }
  ObservationView observations() const {
#define X(name, type, per_slot, part, comment) Span<type>(name.data(), name.size()),
    return {PICTURA_OBSERVATION_ARRAYS(X)};
#undef X
  }
};

/// What the phases need besides state and results.
struct DeviceScratch {
  DeviceBuffer<RuleOptions> options;
  DeviceBuffer<WorldView> worlds, next_worlds;
  DeviceBuffer<cuda::WorldScratch> of_worlds;
  DeviceBuffer<int32_t> cell_begin, cell_items;  // each world's one cell: {0, boxes}; and 0, 1, 2, ...
  DeviceBuffer<Vec2> cell_centers;
  DeviceBuffer<AgentBox> try_boxes;
  DeviceBuffer<uint32_t> free_tries;
  DeviceBuffer<int32_t> known_tries, chosen_try, next_try;
  DeviceBuffer<float> step_m;
  DeviceBuffer<uint8_t> began, prepares;
  DeviceBuffer<int32_t> rejected_slot;
  MappedValue<int64_t> rejected_command;
};

/// The part of the state that an episode begins with, for the next one.
struct DeviceNext {
  DeviceAgents agents;
  DeviceBuffer<AgentBox> boxes;
  DeviceBuffer<LightPlan> light_plans;
  DeviceBuffer<LightState> lights;
  DeviceBuffer<int32_t> spawned;

  explicit DeviceNext(const WorldBatch& batch)
      : agents(static_cast<size_t>(batch.num_slots())),
        boxes(batch.boxes.size()),
        light_plans(batch.light_plans.size()),
        lights(batch.lights.size()),
        spawned(batch.worlds.size()) {}
};

/// A stream beside the caller's, and what ties them together.
class SideStream {
 public:
  SideStream() {
    // Of a higher priority: what is put there is little, and everybody waits for its end.
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
  cuda::StepStreams streams_from(Stream stream) const {
    return {static_cast<cudaStream_t>(stream.handle), side_.get(), forked_.get(), joined_.get()};
  }

 private:
  struct Destroy {
    void operator()(cudaStream_t stream) const { cudaStreamDestroy(stream); }
    void operator()(cudaEvent_t event) const { cudaEventDestroy(event); }
  };
  using Event = std::unique_ptr<std::remove_pointer_t<cudaEvent_t>, Destroy>;
  std::unique_ptr<std::remove_pointer_t<cudaStream_t>, Destroy> side_;
  Event forked_, joined_;
};

class SimulatorCuda final : public Simulator {
 public:
  SimulatorCuda(const SimulatorConfig& config, std::vector<std::shared_ptr<const RoadMap>> maps,
                std::vector<WorldSpec> worlds)
      : batch_(std::make_unique<WorldBatch>(config, std::move(maps), std::move(worlds))),
        agents_(static_cast<size_t>(batch_->num_slots())),
        next_(*batch_),
        results_(static_cast<size_t>(batch_->num_slots()), config) {
    for (const MapView& map : batch_->map_views) maps_.emplace_back(map);
    WorldBatch::visit_state(*batch_, state_, [](const auto& host, auto& device) { device = device_copy(host); });
    world_begin_ = device_copy(batch_->box_begin);
    light_begin_ = device_copy(batch_->light_begin);
    geometry_ = device_copy(batch_->geometry);
    slots_ = {device_copy(batch_->world_of_slot), device_copy(batch_->agent_of_slot), device_copy(batch_->slot_begin),
              device_copy(batch_->global_world)};
    scene_.device = {MemorySpace::cuda, device_.number()};
    scene_.world_begin = world_begin_.span();
    scene_.agents = state_.boxes.span();
    scene_.geometry = geometry_.span();
    scene_.light_begin = light_begin_.span();
    scene_.light_states = state_.lights.span();
    allocate_scratch();
    upload_worlds();
    reset({});
    synchronize();
  }

  std::string_view name() const override { return "cuda"; }
  MemorySpace space() const override { return MemorySpace::cuda; }
  const SimulatorConfig& config() const override { return batch_->config; }
  const std::vector<std::shared_ptr<const RoadMap>>& maps() const override { return batch_->maps; }
  const std::vector<WorldSpec>& worlds() const override { return batch_->worlds; }
  int num_slots() const override { return batch_->num_slots(); }

  void reset(Stream stream) override {
    device_.check_current("simulator cuda");
    throw_rejected();
    cuda::launch_reset(arrays(), side_.streams_from(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

  StepResult step(Span<const int32_t> actions, Stream stream) override { return step_all(actions, "actions", stream); }
  StepResult step(Span<const Command> commands, Stream stream) override {
    return step_all(commands, "commands", stream);
  }
  void check() override {
    synchronize();
    throw_rejected();
  }

  ObservationView observations() override { return results_.observations(); }
  const SceneBatch& scene() override { return scene_; }
  Span<const View> views() override { return results_.views.span(); }
  std::vector<StaticGeometry> geometries() const override { return batch_->geometries(); }

  ControllerInput controller_input() override {
    return {Device{MemorySpace::cuda, device_.number()},
            slots_.table(),
            results_.observations(),
            scene_,
            results_.views.span(),
            agents_.view(),
            state_.episode_step.span(),
            state_.episode_index.span(),
            state_.world_totals.span()};
  }

  AgentStateView state() override { return agents_.view(); }
  Span<const int32_t> episode_step() const override { return state_.episode_step.span(); }
  Span<const int32_t> episode_index() const override { return state_.episode_index.span(); }

  SpawnReport spawn_report() const override {
    synchronize();
    state_.boxes.copy_to_host(batch_->boxes.data());
    state_.spawned.copy_to_host(batch_->spawned.data());
    agents_.refusal.copy_to_host(batch_->agents.refusal.data());
    return batch_->spawn_report();
  }
  const SimulatorTotals& totals() const override {
    synchronize();
    state_.world_totals.copy_to_host(batch_->world_totals.data());
    totals_ = batch_->totals();
    return totals_;
  }
  uint64_t state_hash() const override {
    download();
    return batch_->state_hash();
  }

  std::vector<uint8_t> save() const override {
    download();
    return batch_->save();
  }
  void restore(Span<const uint8_t> bytes) override {
    download();  // what a refused restore leaves as it was
    batch_->restore(bytes);
    agents_.copy_from(batch_->agents);
    WorldBatch::visit_state(*batch_, state_, [](auto& host, auto& device) { device.copy_from_host(host.data()); });
    upload_worlds();
    results_.clear();
    cuda::launch_restored(arrays(), side_.streams_from({}));
    PICTURA_CUDA(cudaGetLastError());
    synchronize();
  }

 private:
  void synchronize() const {
    device_.check_current("simulator cuda");
    PICTURA_CUDA(cudaDeviceSynchronize());
  }
  template <typename T>
  static DeviceBuffer<T> device_copy(const std::vector<T>& host) {
    return DeviceBuffer<T>(Span<const T>(host));
  }

  /// The state to the host, once all streams are done with it.
  void download() const {
    synchronize();
    agents_.copy_to(&batch_->agents);
    WorldBatch::visit_state(*batch_, state_, [](auto& host, const auto& device) { device.copy_to_host(host.data()); });
  }

  template <typename CommandType>
  StepResult step_all(Span<const CommandType> commands, const char* what, Stream stream) {
    device_.check_current("simulator cuda");
    throw_rejected();
    PICTURA_CHECK(commands.size() == static_cast<size_t>(num_slots()), "step: expected {} {}, got {}", num_slots(),
                  what, commands.size());
    cuda::launch_step(arrays(), commands.data(), side_.streams_from(stream));
    PICTURA_CUDA(cudaGetLastError());
    return {results_.reward.span(), results_.terminated.span(), results_.truncated.span(), results_.valid.span(),
            agents_.refusal.span()};
  }

  void throw_rejected() {
    const int64_t rejected = *scratch_.rejected_command.host();
    if (rejected == kNothingRejected) return;
    *scratch_.rejected_command.host() = kNothingRejected;
    fail("step: in an earlier call: {}", rejection_text(rejected));
  }

  void allocate_scratch() {
    const size_t num_worlds = batch_->worlds.size(), num_boxes = batch_->boxes.size();
    std::vector<int32_t> cell_begin;
    int32_t max_boxes = 0;
    for (size_t w = 0; w < num_worlds; ++w) {
      const int32_t boxes = batch_->box_begin[w + 1] - batch_->box_begin[w];
      cell_begin.insert(cell_begin.end(), {0, boxes});
      max_boxes = std::max(max_boxes, boxes);
    }
    std::vector<int32_t> cell_items(static_cast<size_t>(max_boxes));
    std::iota(cell_items.begin(), cell_items.end(), 0);
    scratch_.options = DeviceBuffer<RuleOptions>(Span<const RuleOptions>(&batch_->options, 1));
    scratch_.worlds = DeviceBuffer<WorldView>(num_worlds);
    scratch_.next_worlds = DeviceBuffer<WorldView>(num_worlds);
    scratch_.of_worlds = DeviceBuffer<cuda::WorldScratch>(num_worlds);
    scratch_.cell_begin = device_copy(cell_begin);
    scratch_.cell_items = device_copy(cell_items);
    scratch_.cell_centers = DeviceBuffer<Vec2>(num_boxes);
    scratch_.try_boxes = DeviceBuffer<AgentBox>(num_boxes * kSpawnTries);
    scratch_.free_tries = DeviceBuffer<uint32_t>(num_boxes);
    scratch_.known_tries = DeviceBuffer<int32_t>(num_boxes);
    scratch_.chosen_try = DeviceBuffer<int32_t>(num_boxes);
    scratch_.next_try = DeviceBuffer<int32_t>(num_boxes);
    scratch_.step_m = DeviceBuffer<float>(static_cast<size_t>(num_slots()));
    scratch_.began = DeviceBuffer<uint8_t>(num_worlds);
    scratch_.prepares = DeviceBuffer<uint8_t>(num_worlds);
    scratch_.rejected_slot = DeviceBuffer<int32_t>(1);
    *scratch_.rejected_command.host() = kNothingRejected;
  }

  /// The worlds as the rules see them, at the episodes that the host's state is in, over device memory.
  void upload_worlds() {
    std::vector<WorldView> worlds, next_worlds;
    std::vector<cuda::WorldScratch> of_worlds;
    for (int w = 0; w < batch_->num_worlds(); ++w) {
      const auto index = static_cast<size_t>(w);
      const int32_t first_box = batch_->box_begin[index], first_light = batch_->light_begin[index];
      WorldView view =
          batch_->world(w, maps_[static_cast<size_t>(batch_->worlds[index].map)].view(), *scratch_.options.data());
      view.agents = agents_.view();
      view.boxes = state_.boxes.data() + first_box;
      view.boxes_before = state_.boxes_before.data() + first_box;
      view.box_cells = cuda::one_cell({scratch_.cell_begin.data() + 2 * w, 2},
                                      {scratch_.cell_items.data(), static_cast<size_t>(view.num_boxes)});
      view.cell_centers = scratch_.cell_centers.data() + first_box;
      view.light_plans = state_.light_plans.data() + first_light;
      view.lights = state_.lights.data() + first_light;
      worlds.push_back(view);
      ++view.episode;
      view.agents = next_.agents.view();
      view.boxes = view.boxes_before = next_.boxes.data() + first_box;
      view.light_plans = next_.light_plans.data() + first_light;
      view.lights = next_.lights.data() + first_light;
      next_worlds.push_back(view);
      of_worlds.push_back({scratch_.try_boxes.data() + first_box * kSpawnTries, scratch_.free_tries.data() + first_box,
                           scratch_.known_tries.data() + first_box, scratch_.chosen_try.data() + first_box,
                           scratch_.next_try.data() + first_box});
    }
    scratch_.worlds.copy_from_host(worlds.data());
    scratch_.next_worlds.copy_from_host(next_worlds.data());
    scratch_.of_worlds.copy_from_host(of_worlds.data());
  }

  cuda::SimulatorArrays arrays() {
    cuda::SimulatorArrays arrays;
    arrays.worlds = scratch_.worlds.data();
    arrays.next_worlds = scratch_.next_worlds.data();
    arrays.scratch = scratch_.of_worlds.data();
    arrays.world_of_slot = slots_.world_of_slot.data();
    arrays.agents = agents_.view();
    arrays.next_agents = next_.agents.view();
    arrays.num_worlds = batch_->num_worlds();
    arrays.num_slots = batch_->num_slots();
    arrays.episode_step = state_.episode_step.data();
    arrays.episode_index = state_.episode_index.data();
    arrays.episode_over = state_.episode_over.data();
    arrays.spawned = state_.spawned.data();
    arrays.world_totals = state_.world_totals.data();
    arrays.results = results_.step_arrays();
    arrays.views = results_.views.data();
    arrays.observations = results_.observations();
    arrays.entity_sets = batch_->config.vector_observations;
    arrays.step_m = scratch_.step_m.data();
    arrays.began = scratch_.began.data();
    arrays.prepares = scratch_.prepares.data();
    arrays.next_spawned = next_.spawned.data();
    arrays.rejected_slot = scratch_.rejected_slot.data();
    arrays.rejected_command = scratch_.rejected_command.device();
    return arrays;
  }

  CurrentDevice device_;
  // Checks and describes; its state is the device's only once download() has copied it.
  std::unique_ptr<WorldBatch> batch_;
  std::vector<DeviceMap> maps_;
  DeviceAgents agents_;
  DeviceState state_;
  DeviceNext next_;
  DeviceResults results_;
  DeviceScratch scratch_;
  DeviceSlots slots_;
  SideStream side_;
  DeviceBuffer<int32_t> world_begin_, light_begin_;
  DeviceBuffer<GeometryHandle> geometry_;
  SceneBatch scene_;
  mutable SimulatorTotals totals_;
};

}  // namespace

std::unique_ptr<Simulator> make_cuda_simulator(const SimulatorConfig& config,
                                               std::vector<std::shared_ptr<const RoadMap>> maps,
                                               std::vector<WorldSpec> worlds) {
  return std::make_unique<SimulatorCuda>(config, std::move(maps), std::move(worlds));
}

}  // namespace pictura
