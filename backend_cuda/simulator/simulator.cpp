// The simulator in device memory: SimulatorSetup checks and describes it on the host, and kernels step the state. Steps
// and restores of snapshots neither wait nor allocate; copies to or from the host wait for their stream.
#include "pictura/simulator/simulator.h"

#include <memory>
#include <numeric>
#include <optional>

#include "pictura/backend_cuda/simulator/device_memory.h"
#include "pictura/common/cuda/check.h"
#include "pictura/common/cuda/device_guard.h"
#include "pictura/common/error.h"
#include "pictura/simulator/simulator_state.h"

namespace pictura {

std::unique_ptr<Simulator> make_cuda_simulator(SimulatorSetup setup);

namespace {

cudaStream_t handle_of(Stream stream) { return static_cast<cudaStream_t>(stream.handle); }

struct DeviceSnapshot final : StateSnapshot {
  WorldsToken worlds;
  DeviceState state;
};

class SimulatorCuda final : public Simulator {
 public:
  SimulatorCuda(SimulatorSetup setup, Device device) : Simulator("cuda"), device_(device), setup_(std::move(setup)) {
    parts_ = &setup_;
    const DeviceGuard guard(device_);
    side_ = std::make_unique<SideStream>();
    rejected_command_ = std::make_unique<MappedValue<int64_t>>();
    *rejected_command_->host() = kNoRejection;
    faulty_edit_ = std::make_unique<MappedValue<int64_t>>();
    *faulty_edit_->host() = kNoEditFault;
    faulty_query_ = std::make_unique<MappedValue<int64_t>>();
    *faulty_query_->host() = kNoQueryFault;
    allocate(setup_.needs());
    begin(nullptr);
    PICTURA_CUDA(cudaDeviceSynchronize());  // so that any stream can be used
  }

  void set_worlds(CompiledMaps maps, std::vector<GeometryHandle> handles, std::vector<WorldSpec> worlds, uint64_t seed,
                  Stream stream) override {
    const DeviceGuard guard(device_);
    throw_rejected();
    SimulatorSetup next = setup_.with(std::move(maps), std::move(handles), std::move(worlds), seed);
    if (!capacity_.holds(next.needs())) grow(next.needs());
    setup_ = std::move(next);
    begin(handle_of(stream));
  }
  void reserve(const SimulatorCapacity& capacity) override {
    if (capacity_.holds(capacity)) return;
    const DeviceGuard guard(device_);
    PICTURA_CUDA(cudaDeviceSynchronize());
    state_.get_to(&host_, nullptr);
    PICTURA_CUDA(cudaStreamSynchronize(nullptr));
    grow(capacity);
    put_setup(nullptr);
    results_.clear(nullptr);
    put_state(nullptr);
    PICTURA_CUDA(cudaDeviceSynchronize());
  }

  void poll() override { throw_rejected(); }
  void check(Stream stream) override {
    const DeviceGuard guard(device_);
    PICTURA_CUDA(cudaStreamSynchronize(handle_of(stream)));
    throw_rejected();
  }

  SpawnReport spawn_report(Stream stream) const override {
    const DeviceGuard guard(device_);
    get(state_.boxes, &host_.boxes, handle_of(stream));
    get(state_.spawned, &host_.spawned, handle_of(stream));
    get(state_.agents.refusal, &host_.agents.refusal, handle_of(stream));
    get(state_.agents.status, &host_.agents.status, handle_of(stream));
    get(state_.agents.life, &host_.agents.life, handle_of(stream));
    PICTURA_CUDA(cudaStreamSynchronize(handle_of(stream)));
    return host_.spawn_report(setup_);
  }
  const SimulatorTotals& totals(Stream stream) const override {
    const DeviceGuard guard(device_);
    get(state_.world_totals, &host_.world_totals, handle_of(stream));
    PICTURA_CUDA(cudaStreamSynchronize(handle_of(stream)));
    totals_ = host_.totals();
    return totals_;
  }
  uint64_t state_hash(Stream stream) const override {
    download(stream);
    return host_.hash(setup_);
  }

  std::vector<uint8_t> save(Stream stream) const override {
    download(stream);
    return host_.save(setup_);
  }
  void restore(Span<const uint8_t> bytes, Stream stream) override {
    const DeviceGuard guard(device_);
    host_.restore(setup_, bytes);
    put_state(handle_of(stream));
  }
  std::unique_ptr<StateSnapshot> snapshot(Stream stream) const override {
    const DeviceGuard guard(device_);
    auto copy = std::make_unique<DeviceSnapshot>();
    copy->worlds = worlds_token_;
    copy->state = DeviceState(num_slots(), setup_.num_boxes(), setup_.num_lights(), setup_.worlds.size());
    state_.copy_to(copy->state, handle_of(stream));
    return copy;
  }
  void restore(const StateSnapshot& snapshot, Stream stream) override {
    const auto* copy = dynamic_cast<const DeviceSnapshot*>(&snapshot);
    PICTURA_CHECK(copy && copy->worlds == worlds_token_,
                  "restore: expected a snapshot of these worlds of this simulator");
    const DeviceGuard guard(device_);
    copy->state.copy_to(state_, handle_of(stream));
    publish_restored(handle_of(stream));
  }

 private:
  StepResult step_actions(Span<const int32_t> actions, Stream stream) override { return step_all(actions, stream); }
  StepResult step_commands(Span<const Command> commands, Stream stream) override { return step_all(commands, stream); }

  void reset_worlds(Span<const uint8_t> world_mask, uint64_t seed, Stream stream) override {
    const DeviceGuard guard(device_);
    throw_rejected();
    cuda::launch_reset(phase_arrays(), world_mask.data(), seed, side_->streams_from(handle_of(stream)));
    PICTURA_CUDA(cudaGetLastError());
  }
  void apply_edit(const StateEdit& edit, Stream stream) override {
    const DeviceGuard guard(device_);
    throw_rejected();
    cuda::launch_edit(phase_arrays(), edit, side_->streams_from(handle_of(stream)));
    PICTURA_CUDA(cudaGetLastError());
  }
  void answer_queries(const ObservationQueries& asked, Stream stream) override {
    const DeviceGuard guard(device_);
    throw_rejected();
    cuda::launch_queries(phase_arrays(), asked, side_->streams_from(handle_of(stream)));
    PICTURA_CUDA(cudaGetLastError());
  }

  /// Allocates for this capacity and at least the previous one; the previous contents are lost.
  void grow(const SimulatorCapacity& capacity) {
    PICTURA_CUDA(cudaDeviceSynchronize());
    allocate(capacity_.joined(capacity));
    ++generation_;
  }
  void allocate(const SimulatorCapacity& capacity) {
    capacity_ = {};  // until everything is allocated
    // Freed first, so that old and new memory need not fit together.
    state_ = {};
    results_ = {};
    scratch_ = {};
    tables_ = {};
    maps_ = {};
    const auto num_slots = static_cast<size_t>(capacity.slots), num_worlds = static_cast<size_t>(capacity.worlds);
    const auto num_boxes = static_cast<size_t>(capacity.boxes(config()));
    const auto num_lights = static_cast<size_t>(capacity.lights);
    state_ = DeviceState(num_slots, num_boxes, num_lights, num_worlds);
    results_ = DeviceResults(num_slots, config());
    scratch_ = DeviceScratch(num_slots, num_boxes, num_lights, num_worlds);
    tables_ = DeviceSetup(num_slots, num_worlds);
    maps_ = DeviceMaps(static_cast<size_t>(capacity.maps), static_cast<size_t>(capacity.map_bytes));
    capacity_ = capacity;
  }

  /// Starts the setup's worlds at their first episodes.
  void begin(cudaStream_t stream) {
    worlds_token_ = new_worlds_token();
    host_.resize(setup_);
    put_setup(stream);
    state_.put_from(host_, stream);
    results_.clear(stream);
    cuda::launch_reset(phase_arrays(), nullptr, config().seed, side_->streams_from(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

  void put_setup(cudaStream_t stream) {
    maps_.load(setup_.maps, stream);
    tables_.put_from(setup_, stream);
    put_scratch(stream);
    put_worlds(stream);
    show_arrays();
  }

  void show_arrays() {
    const auto num_slots = static_cast<size_t>(setup_.num_slots()), num_worlds = setup_.worlds.size();
    arrays_ = {.device = device_,
               .slots = {.world_of_slot = {tables_.world_of_slot.data(), num_slots},
                         .agent_of_slot = {tables_.agent_of_slot.data(), num_slots},
                         .slot_begin = {tables_.slot_begin.data(), num_worlds + 1},
                         .global_world = {tables_.global_world.data(), num_worlds}},
               .observations = results_.observations(num_slots, config()),
               .scene = {.device = device_,
                         .world_begin = {tables_.box_begin.data(), num_worlds + 1},
                         .agents = {state_.boxes.data(), setup_.num_boxes()},
                         .geometry = {tables_.geometry.data(), num_worlds},
                         .light_begin = {tables_.light_begin.data(), num_worlds + 1},
                         .light_states = {state_.lights.data(), setup_.num_lights()},
                         .hidden_agents = {}},
               .driver = {results_.driver.data(), num_slots},
               .views = {results_.views.data(), num_slots},
               .state = state_.agents.view(),
               .episode_step = {state_.episode_step.data(), num_worlds},
               .episode_index = {state_.episode_index.data(), num_worlds},
               .episode_over = {state_.episode_over.data(), num_worlds},
               .world_totals = {state_.world_totals.data(), num_worlds},
               .seed = {state_.seed.data(), num_worlds},
               .results = {.reward = {results_.reward.data(), num_slots},
                           .terminated = {results_.terminated.data(), num_slots},
                           .truncated = {results_.truncated.data(), num_slots},
                           .valid = {results_.valid.data(), num_slots},
                           .refusal = {state_.agents.refusal.data(), num_slots},
                           .sums = {results_.sums.data(), num_slots}}};
  }

  /// Copies the host's state to the device.
  void put_state(cudaStream_t stream) {
    state_.put_from(host_, stream);
    publish_restored(stream);
  }
  void publish_restored(cudaStream_t stream) {
    cuda::launch_publish_restored(phase_arrays(), side_->streams_from(stream));
    PICTURA_CUDA(cudaGetLastError());
  }

  /// Copies the state to the host after the work of the stream.
  void download(Stream stream) const {
    const DeviceGuard guard(device_);
    state_.get_to(&host_, handle_of(stream));
    PICTURA_CUDA(cudaStreamSynchronize(handle_of(stream)));
  }

  template <typename CommandType>
  StepResult step_all(Span<const CommandType> commands, Stream stream) {
    const DeviceGuard guard(device_);
    throw_rejected();
    cuda::launch_step(phase_arrays(), commands.data(), side_->streams_from(handle_of(stream)));
    PICTURA_CUDA(cudaGetLastError());
    return arrays_.results;
  }

  void throw_rejected() {
    if (const auto fault = take(faulty_edit_.get())) {
      fail("set_state: in an earlier call: {}", edit_fault_text(*fault, num_slots()));
    }
    if (const auto fault = take(faulty_query_.get())) {
      fail("observe: in an earlier call: {}", query_fault_text(*fault, num_slots()));
    }
    if (const auto rejected = take(rejected_command_.get())) {
      fail("step: in an earlier call: {}", rejection_text(*rejected));
    }
  }
  /// Returns and clears the fault that the device has latched since the last call, if any.
  static std::optional<int64_t> take(MappedValue<int64_t>* latched) {
    static_assert(kNoRejection == kNoEditFault && kNoQueryFault == kNoEditFault);
    const int64_t fault = *latched->host();
    if (fault == kNoEditFault) return {};
    *latched->host() = kNoEditFault;
    return fault;
  }

  void put_scratch(cudaStream_t stream) {
    std::vector<int32_t> cell_begin;
    int32_t max_boxes = 0;
    for (size_t w = 0; w < setup_.worlds.size(); ++w) {
      const int32_t boxes = setup_.box_begin[w + 1] - setup_.box_begin[w];
      cell_begin.insert(cell_begin.end(), {0, boxes});
      max_boxes = std::max(max_boxes, boxes);
    }
    std::vector<int32_t> cell_items(static_cast<size_t>(max_boxes));
    std::iota(cell_items.begin(), cell_items.end(), 0);
    put(cell_begin, scratch_.cell_begin, stream);
    put(cell_items, scratch_.cell_items, stream);
    put(std::vector<RuleOptions>{setup_.options}, scratch_.options, stream);
  }

  /// Uploads the views through which rules access the worlds. The views refer to device memory.
  void put_worlds(cudaStream_t stream) {
    std::vector<WorldView> worlds, next_worlds;
    std::vector<cuda::WorldScratch> of_worlds;
    has_crowds_ = false;
    for (int w = 0; w < setup_.num_worlds(); ++w) {
      const auto index = static_cast<size_t>(w);
      const int32_t first_box = setup_.box_begin[index], first_light = setup_.light_begin[index];
      const auto& map = setup_.maps[setup_.worlds[index].map];
      WorldView view = setup_.view(w, maps_.view(map), *scratch_.options.data());
      view.agents = state_.agents.view();
      view.boxes = state_.boxes.data() + first_box;
      view.boxes_before = state_.boxes_before.data() + first_box;
      const auto num_boxes = static_cast<size_t>(view.num_boxes);
      const GridView cells = chain_cells(map->rules.low_m, map->rules.high_m, view.num_boxes, kBoxCell_m);
      const bool is_crowd = cuda::is_crowd(view.num_boxes);
      has_crowds_ = has_crowds_ || is_crowd;
      int32_t* const crowd_begin = scratch_.crowd_begin.data() + first_box + w;
      int32_t* const crowd_items = scratch_.crowd_items.data() + first_box;
      view.box_cells =
          is_crowd ? cuda::crowd_cells(cells, crowd_begin, {crowd_items, num_boxes})
                   : cuda::one_cell({scratch_.cell_begin.data() + 2 * w, 2}, {scratch_.cell_items.data(), num_boxes});
      view.cell_centers = scratch_.cell_centers.data() + first_box;
      view.light_plans = state_.light_plans.data() + first_light;
      view.lights = state_.lights.data() + first_light;
      worlds.push_back(view);
      view.agents = scratch_.next_agents.view();
      view.boxes = view.boxes_before = scratch_.next_boxes.data() + first_box;
      view.light_plans = scratch_.next_light_plans.data() + first_light;
      view.lights = scratch_.next_lights.data() + first_light;
      next_worlds.push_back(view);
      of_worlds.push_back({scratch_.try_boxes.data() + first_box * kSpawnTries,
                           scratch_.free_tries.data() + first_box,
                           scratch_.known_tries.data() + first_box,
                           scratch_.chosen_try.data() + first_box,
                           scratch_.next_try.data() + first_box,
                           {cells, scratch_.chain_first.data() + first_box, scratch_.chain_next.data() + first_box},
                           is_crowd ? crowd_begin : nullptr,
                           is_crowd ? crowd_items : nullptr});
    }
    put(worlds, scratch_.worlds, stream);
    put(next_worlds, scratch_.next_worlds, stream);
    put(of_worlds, scratch_.of_worlds, stream);
  }

  cuda::PhaseArrays phase_arrays() {
    PICTURA_CHECK(capacity_.slots > 0, "simulator: an earlier call ran out of device memory: call set_worlds()");
    cuda::PhaseArrays arrays;
    arrays.worlds = scratch_.worlds.data();
    arrays.next_worlds = scratch_.next_worlds.data();
    arrays.scratch = scratch_.of_worlds.data();
    arrays.world_of_slot = tables_.world_of_slot.data();
    arrays.agents = state_.agents.view();
    arrays.next_agents = scratch_.next_agents.view();
    arrays.num_worlds = setup_.num_worlds();
    arrays.num_slots = num_slots();
    arrays.seed = state_.seed.data();
    arrays.episode_step = state_.episode_step.data();
    arrays.episode_index = state_.episode_index.data();
    arrays.episode_over = state_.episode_over.data();
    arrays.spawned = state_.spawned.data();
    arrays.world_totals = state_.world_totals.data();
    arrays.results = results_.step_arrays();
    arrays.views = results_.views.data();
    arrays.driver = results_.driver.data();
    arrays.observations = arrays_.observations;
    arrays.entity_sets = config().vector_observations;
    arrays.has_lives = setup_.has_lives();
    arrays.has_replayed_tracks = setup_.has_replayed_tracks();
    arrays.has_other_drivers = setup_.has_other_drivers();
    arrays.parked_per_world = config().parked_cars;
    arrays.has_crowds = has_crowds_;
    arrays.began = scratch_.began.data();
    arrays.prepares = scratch_.prepares.data();
    arrays.next_spawned = scratch_.next_spawned.data();
    arrays.rejected_slot = scratch_.rejected_slot.data();
    arrays.rejected_command = rejected_command_->device();
    arrays.first_element = scratch_.first_element.data();
    arrays.faulty_element = scratch_.faulty_element.data();
    arrays.faulty_edit = faulty_edit_->device();
    arrays.faulty_query = faulty_query_->device();
    return arrays;
  }

  const Device device_;
  SimulatorSetup setup_;
  SimulatorCapacity capacity_;
  WorldsToken worlds_token_;
  mutable SimulatorState host_;  // the state, valid only after it has been copied to the host
  mutable SimulatorTotals totals_;
  DeviceMaps maps_;
  DeviceSetup tables_;
  DeviceState state_;
  DeviceResults results_;
  DeviceScratch scratch_;
  bool has_crowds_ = false;  // whether some world is a crowd
  std::unique_ptr<SideStream> side_;
  std::unique_ptr<MappedValue<int64_t>> rejected_command_, faulty_edit_, faulty_query_;
};

}  // namespace

std::unique_ptr<Simulator> make_cuda_simulator(SimulatorSetup setup) {
  const Device device = setup.config.device.is_host() ? current_device() : setup.config.device;
  return std::make_unique<SimulatorCuda>(std::move(setup), device);
}

}  // namespace pictura
