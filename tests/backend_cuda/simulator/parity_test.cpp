// The CUDA simulator, on a device, gives the bits of the CPU simulator. Without a device, the tests are skipped; if
// PICTURA_REQUIRE_GPU is 1, they fail instead.
#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/error.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_copy.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/simulator/recorded_scene.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/backend_cuda/on_host.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/simulator/random_edit.h"
#include "pictura/tests/simulator/random_queries.h"
#include "pictura/tests/simulator/same_bits.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/recorded_crossing.h"

namespace pictura {

namespace {

using test::on_host;
using test::same;
using ::testing::HasSubstr;
using Maps = std::vector<std::shared_ptr<const RoadMap>>;

class CudaSimulatorTest : public test::DeviceTest {};

/// Returns an array of actions in a simulator's memory.
Array array_of(const DeviceBuffer<int32_t>& actions, const Simulator& simulator) {
  return {actions.data(), {simulator.num_slots()}, simulator.device()};
}

/// An edit's arrays in device memory.
class DeviceEdit {
 public:
  DeviceEdit(const testing::RandomEdit& edit, Device device) {
    slots_ = copy_of(edit.slots(), device);
    for (const NamedArray& field : edit.fields()) fields_.push_back({field.name, copy_of(field.array, device)});
  }
  const Array& slots() const { return slots_; }
  const std::vector<NamedArray>& fields() const { return fields_; }

 private:
  Array copy_of(const Array& host, Device device) {
    const auto* const bytes = static_cast<const uint8_t*>(host.data);
    memory_.emplace_back(Span<const uint8_t>(bytes, static_cast<size_t>(host.shape.count()) * bytes_of(host.type)));
    return {memory_.back().data(), host.type, host.shape, device};
  }

  std::vector<DeviceBuffer<uint8_t>> memory_;
  Array slots_;
  std::vector<NamedArray> fields_;
};

/// A device observation's copy on the host.
struct HostObservation {
#define X(name, type, rows, features, part, comment) std::vector<type> name;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  explicit HostObservation(const ObservationView& device){
#define X(name, type, rows, features, part, comment) name = on_host(device.name);
      PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  } ObservationView view() {
#define X(name, type, rows, features, part, comment) name,
    return {PICTURA_OBSERVATION_ARRAYS(X)};
#undef X
  }
};

void expect_same_view(Simulator* cpu, Simulator* cuda, int step) {
  ASSERT_EQ(cpu->state_hash(), cuda->state_hash()) << "step " << step;
  ASSERT_EQ(testing::first_difference(cpu->observations(), HostObservation(cuda->observations()).view()), "")
      << "step " << step;
  const SceneBatch &a = cpu->scene(), &b = cuda->scene();
  ASSERT_FALSE(b.device.is_host());
  ASSERT_TRUE(same(a.agents, b.agents) && same(a.light_states, b.light_states)) << "step " << step;
  ASSERT_TRUE(same(a.world_begin, b.world_begin) && same(a.geometry, b.geometry) && same(a.light_begin, b.light_begin));
  ASSERT_TRUE(same(cpu->views(), cuda->views())) << "step " << step;
  ASSERT_TRUE(same(cpu->arrays().driver, cuda->arrays().driver)) << "step " << step;
  ASSERT_TRUE(same(cpu->episode_step(), cuda->episode_step()) && same(cpu->episode_index(), cuda->episode_index()));
}

/// Results of a device's steps, stored in device memory so that no step waits for the host.
class StepLog {
 public:
  StepLog(int steps, int num_slots)
      : num_slots_(static_cast<size_t>(num_slots)),
        reward_(static_cast<size_t>(steps) * num_slots_),
        terminated_(reward_.size()),
        truncated_(reward_.size()),
        valid_(reward_.size()),
        sums_(reward_.size()) {}

  void append(const StepResult& result) {
    append(result.reward, &reward_);
    append(result.terminated, &terminated_);
    append(result.truncated, &truncated_);
    append(result.valid, &valid_);
    append(result.sums, &sums_);
    ++num_steps_;
  }
  void copy_to_host() {
    host_reward_ = on_host(reward_.span());
    host_terminated_ = on_host(terminated_.span());
    host_truncated_ = on_host(truncated_.span());
    host_valid_ = on_host(valid_.span());
    host_sums_ = on_host(sums_.span());
  }
  /// Returns a step's result on the host. Refused spawns are excluded because they are state.
  StepResult of_step(int step) const {
    const auto part = [&](const auto& log) {
      return Span(log.data() + static_cast<size_t>(step) * num_slots_, num_slots_);
    };
    return {part(host_reward_), part(host_terminated_), part(host_truncated_), part(host_valid_), {}, part(host_sums_)};
  }

 private:
  template <typename T>
  void append(Span<const T> result, DeviceBuffer<T>* log) {
    PICTURA_CUDA(cudaMemcpyAsync(log->data() + num_steps_ * num_slots_, result.data(), result.size() * sizeof(T),
                                 cudaMemcpyDeviceToDevice, nullptr));
  }

  size_t num_slots_, num_steps_ = 0;
  DeviceBuffer<float> reward_;
  DeviceBuffer<uint8_t> terminated_, truncated_, valid_;
  DeviceBuffer<StepSums> sums_;
  std::vector<float> host_reward_;
  std::vector<uint8_t> host_terminated_, host_truncated_, host_valid_;
  std::vector<StepSums> host_sums_;
};

/// Steps both simulators with the same actions and compares the results of all steps. The device runs ahead: with a
/// wait for each step, tests that share a device would take turns at it thousands of times.
void step_same(Simulator* cpu, Simulator* cuda, int steps, uint32_t first_step) {
  const int slots = cpu->num_slots();
  std::vector<int32_t> actions;
  for (int i = 0; i < steps; ++i) {
    const std::vector<int32_t> drawn = testing::mixed_actions(slots, first_step + static_cast<uint32_t>(i));
    actions.insert(actions.end(), drawn.begin(), drawn.end());
  }
  const DeviceBuffer<int32_t> device_actions{Span<const int32_t>(actions)};
  StepLog log(steps, slots);
  for (int i = 0; i < steps; ++i) {
    log.append(cuda->step(Array(device_actions.data() + int64_t{i} * slots, {slots}, cuda->device())));
  }
  log.copy_to_host();
  for (int i = 0; i < steps; ++i) {
    const StepResult a = cpu->step(Array(actions.data() + int64_t{i} * slots, {slots}, cpu->device()));
    const StepResult b = log.of_step(i);
    ASSERT_TRUE(testing::same_bits(a.reward, b.reward)) << "step " << first_step + static_cast<uint32_t>(i);
    ASSERT_TRUE(testing::same_bits(a.terminated, b.terminated) && testing::same_bits(a.truncated, b.truncated) &&
                testing::same_bits(a.valid, b.valid) && testing::same_bits(a.sums, b.sums))
        << "step " << first_step + static_cast<uint32_t>(i);
  }
}

/// Steps both simulators. Compares results at every step, and all public outputs every `check_every` steps.
void run_same(Simulator* cpu, Simulator* cuda, int steps, int check_every, uint32_t first_step = 0) {
  expect_same_view(cpu, cuda, 0);
  for (int done = 0; done < steps && !::testing::Test::HasFatalFailure();) {
    const int stretch = std::min(check_every, steps - done);
    step_same(cpu, cuda, stretch, first_step + static_cast<uint32_t>(done) + 1);
    if (::testing::Test::HasFatalFailure()) return;
    done += stretch;
    expect_same_view(cpu, cuda, done);
  }
  ASSERT_EQ(cpu->save(), cuda->save()) << "totals included";
}

void expect_parity(const SimulatorConfig& config, const Maps& maps, const std::vector<WorldSpec>& worlds, int steps,
                   int check_every = 100) {
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  run_same(cpu.get(), cuda.get(), steps, check_every);
  const SpawnReport a = cpu->spawn_report(), b = cuda->spawn_report();
  EXPECT_EQ(a.spawned, b.spawned);
  EXPECT_EQ(a.parked_placed, b.parked_placed);
  EXPECT_EQ(cpu->totals().reward, cuda->totals().reward);
}

SimulatorConfig whole_world() {
  SimulatorConfig config;
  config.wall_observations = true;
  return config;
}

TEST_F(CudaSimulatorTest, ProceduralTownsOver1000Steps) {
  for (const char* name : {"procedural:1", "procedural:2", "procedural:3", "procedural:3#3"}) {
    SCOPED_TRACE(name);
    expect_parity(whole_world(), {load_map(name)}, {{0, 120, 0}}, 1000);
  }
}

TEST_F(CudaSimulatorTest, CarlaTownsOver1000Steps) {
  const std::vector<std::string> towns = known_towns();
  if (towns.empty()) GTEST_SKIP() << "no towns: set PICTURA_DATA";
  for (const std::string& town : towns) {
    SCOPED_TRACE(town);
    expect_parity(whole_world(), {load_map(town)}, {{0, 120, 0}}, 1000);
  }
}

TEST_F(CudaSimulatorTest, IndependentLights) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 200;
  config.light_cycles = LightCycles::independent;
  for (const bool fixed : {false, true}) {
    config.fixed_lights = fixed;
    expect_parity(config, {load_map("procedural:1")}, draw_worlds(5, 120, 1, 60, 1), 500);
  }
}

TEST_F(CudaSimulatorTest, StaggeredEpisodesAndResetsAtStandstill) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 200;
  config.stagger_episodes = true;
  config.dynamics = {.reset_at_standstill = true};
  config.reset_inactive_fraction = 2;
  expect_parity(config, {load_map("procedural:1")}, draw_worlds(5, 120, 1, 20, 1), 500);
}

TEST_F(CudaSimulatorTest, ImpairedAgents) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 200;
  config.others = {.blind = 0.3f, .phantom_braking = 0.2f, .inattentive = 0.2f, .policies = {0.1f, 0.1f}};
  expect_parity(config, {load_map("procedural:1")}, draw_worlds(5, 120, 1, 60, 1), 500);
}

TEST_F(CudaSimulatorTest, OpenRoadsOver1000Steps) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 700;
  config.reset_inactive_fraction = 2;
  config.parked_cars = 4;
  Maps maps{std::make_shared<RoadMap>(parse_opendrive(test::open_street(), "street.xodr")),
            std::make_shared<RoadMap>(parse_opendrive(test::open_crossing(), "crossing.xodr")),
            std::make_shared<RoadMap>(parse_opendrive(test::open_ramp(), "ramp.xodr"))};
  std::vector<WorldSpec> worlds{{0, 60, 0}, {1, 40, 1}, {2, 120, 2}, {0, 3, 3}};
  for (const std::string& map_case : test::map_cases()) {
    worlds.push_back({static_cast<int>(maps.size()), 16, static_cast<uint32_t>(worlds.size())});
    maps.push_back(load_map(map_case));
  }
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  for (int step = 0; step < 1000; ++step) {
    const std::vector<int32_t> actions = testing::straight_actions(cpu->state(), cpu->num_slots());
    const DeviceBuffer<int32_t> device_actions{Span<const int32_t>(actions)};
    cpu->step(actions);
    cuda->step(Array(device_actions.data(), {cpu->num_slots()}, cuda->device()));
    if (step % 50 == 0) expect_same_view(cpu.get(), cuda.get(), step);
    ASSERT_EQ(cpu->state_hash(), cuda->state_hash()) << "step " << step;
  }
  EXPECT_EQ(cpu->save(), cuda->save());
  const SpawnReport a = cpu->spawn_report(), b = cuda->spawn_report();
  EXPECT_GT(a.entered, 20);
  EXPECT_EQ(a.entered, b.entered);
  EXPECT_EQ(a.left, b.left);
}

TEST_F(CudaSimulatorTest, TenThousandSteps) {
  expect_parity(whole_world(), {load_map("procedural:4")}, {{0, 120, 0}}, 10'000, 1000);
}

TEST_F(CudaSimulatorTest, ThousandsOfSmallWorldsOnManyMaps) {
  SimulatorConfig config = whole_world();
  config.parked_cars = 3;
  config.episode_steps = 40;
  const Maps maps{load_map("procedural:1"), load_map("procedural:2"), load_map("procedural:3")};
  expect_parity(config, maps, draw_worlds(1, 8000, 1, 5, 3), 100, 25);
}

TEST_F(CudaSimulatorTest, WorldsOnManyCopies) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 40;
  const std::vector<std::string> names =
      with_map_copies(expand_map_names({"procedural:1-2:blocks=2x2"}), /*copies=*/19);
  expect_parity(config, load_maps(names), draw_worlds(1, 2000, 1, 20, static_cast<int>(names.size())), 100, 25);
}

TEST_F(CudaSimulatorTest, CrowdsUpToTheLargestWorld) {
  SimulatorConfig config;
  config.episode_steps = 20;
  config.vector_observations = false;
  expect_parity(config, {load_map("procedural:1")}, {{0, kMaxAgentsPerWorld, 0}, {0, 1000, 1}, {0, 1, 2}}, 45, 5);
}

/// Drives recorded scenes. Random actions control a fifth of the agents at a time.
void expect_same_records(AfterInfraction after_infraction, bool leave_at_goal) {
  const auto scene = test::crossing({.num_vehicles = 40, .num_pedestrians = 10});
  SimulatorConfig config = scene_config(*scene);
  config.episode_steps = 100;  // longer than the record
  config.after_infraction = after_infraction;
  config.leave_at_goal = leave_at_goal;
  MapOptions lit = map_options(config);
  lit.recorded_lights = true;
  const CompiledMaps maps{compile_scenario(scene, map_options(config)), compile_scenario(scene, lit, 30)};
  const std::vector<WorldSpec> worlds{scene_world(*maps[0], 0, 0), scene_world(*maps[1], 1, 1)};
  const auto cpu = make_simulator("cpu", config, maps, worlds), cuda = make_simulator("cuda", config, maps, worlds);
  const auto log = make_controller("log", *cuda, 0), random = make_controller("random", *cuda, 5);
  const auto host_log = make_controller("log", *cpu, 0), host_random = make_controller("random", *cpu, 5);
  const auto num_slots = static_cast<size_t>(cpu->num_slots());
  DeviceBuffer<Command> commands(num_slots);
  std::vector<Command> host_commands(num_slots);
  for (int step = 0; step < 250; ++step) {
    expect_same_view(cpu.get(), cuda.get(), step);
    std::vector<uint8_t> mask(num_slots);
    for (size_t slot = 0; slot < num_slots; ++slot) mask[slot] = (slot + static_cast<size_t>(step) / 20) % 5 == 0;
    const DeviceBuffer<uint8_t> device_mask{Span<const uint8_t>(mask)};
    const Span<Command> device_commands(commands.data(), num_slots);
    log->act(cuda->arrays(), {}, device_commands);
    random->act(cuda->arrays(), device_mask.span(), device_commands);
    host_log->act(cpu->arrays(), {}, host_commands);
    host_random->act(cpu->arrays(), mask, host_commands);
    cuda->step(Span<const Command>(device_commands));
    cpu->step(host_commands);
  }
  ASSERT_EQ(cpu->save(), cuda->save());
}

TEST_F(CudaSimulatorTest, ReplaysTracksOfTheChosenMap) {
  const auto scene = test::crossing({.num_vehicles = 40, .num_pedestrians = 10});
  SimulatorConfig config = scene_config(*scene);
  config.reset_inactive_fraction = 1;
  config.leave_at_goal = true;
  const auto whole = compile_scenario(scene, map_options(config));
  std::vector<int32_t> driven, replayed;
  for (int32_t track = 0; track < static_cast<int32_t>(scene->tracks.size()); ++track) {
    (track % 3 == 0 ? driven : replayed).push_back(track);
  }
  config.parked_cars = static_cast<int>(replayed.size()) + 2;
  const auto num_agents = static_cast<int>(driven.size()) + 5;
  const CompiledMaps maps{with_tracks(*whole, driven, replayed, num_agents),
                          compile_map(load_map("procedural:1"), map_options(config))};
  const std::vector<WorldSpec> worlds{{0, num_agents, 0}, {0, 7, 1}, {1, 20, 2}};
  const auto cpu = make_simulator("cpu", config, maps, worlds), cuda = make_simulator("cuda", config, maps, worlds);
  run_same(cpu.get(), cuda.get(), 250, 25);
}

TEST_F(CudaSimulatorTest, FollowsRecordsAndTakesOver) { expect_same_records(AfterInfraction::halt, false); }

TEST_F(CudaSimulatorTest, EndsAgentsByTheRules) {
  expect_same_records(AfterInfraction::leave, true);
  expect_same_records(AfterInfraction::drive_on, true);
}

TEST_F(CudaSimulatorTest, SavesAndRestoresAcrossBackends) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 70;
  const Maps maps{load_map("procedural:1"), load_map("procedural:2")};
  const std::vector<WorldSpec> worlds = draw_worlds(3, 400, 1, 120, 2);
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  run_same(cpu.get(), cuda.get(), 100, 100);
  const auto cpu_after = make_simulator("cpu", config, maps, worlds);
  const auto cuda_after = make_simulator("cuda", config, maps, worlds);
  cpu_after->restore(cuda->save());
  cuda_after->restore(cpu->save());
  run_same(cpu_after.get(), cuda_after.get(), 100, 20, 100);
  run_same(cpu.get(), cuda.get(), 100, 20, 100);
  EXPECT_EQ(cpu->state_hash(), cuda_after->state_hash());
  std::vector<uint8_t> broken = cpu->save();
  broken.pop_back();
  EXPECT_THROW(cuda->restore(broken), Error);
  EXPECT_EQ(cpu->state_hash(), cuda->state_hash());
  cpu->reset();
  cuda->reset();
  expect_same_view(cpu.get(), cuda.get(), 0);
}

TEST_F(CudaSimulatorTest, AGraphReplaysSteps) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 50;
  const Maps maps{load_map("procedural:1")};
  const std::vector<WorldSpec> worlds = draw_worlds(3, 300, 1, 60, 1);
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  DeviceBuffer<int32_t> actions(300);
  cudaStream_t stream = nullptr;
  PICTURA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  cudaGraph_t graph = nullptr;
  PICTURA_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
  cuda->step(array_of(actions, *cuda), {stream});
  PICTURA_CUDA(cudaStreamEndCapture(stream, &graph));
  cudaGraphExec_t executable = nullptr;
  PICTURA_CUDA(cudaGraphInstantiate(&executable, graph, 0));
  for (uint32_t step = 0; step < 200; ++step) {
    const std::vector<int32_t> host = testing::mixed_actions(300, step);
    PICTURA_CUDA(
        cudaMemcpyAsync(actions.data(), host.data(), host.size() * sizeof(int32_t), cudaMemcpyHostToDevice, stream));
    PICTURA_CUDA(cudaGraphLaunch(executable, stream));
    cpu->step(host);
  }
  cuda->check({stream});
  expect_same_view(cpu.get(), cuda.get(), 200);
  EXPECT_GT(cuda->totals().episodes, 0) << "resets are part of the graph";
  PICTURA_CUDA(cudaGraphExecDestroy(executable));
  PICTURA_CUDA(cudaGraphDestroy(graph));
  PICTURA_CUDA(cudaStreamDestroy(stream));
}

TEST_F(CudaSimulatorTest, ReplacedWorldsEqualANewSimulatorsAndAllocateNothing) {
  const SimulatorConfig config{.episode_steps = 25, .parked_cars = 5};
  const CompiledMaps maps =
      compile_maps({load_map("procedural:1"), load_map("procedural:2"), load_map("procedural:3")}, map_options(config));
  const std::vector<WorldSpec> many = draw_worlds(2, 400, 1, 120, 3);
  const auto cuda = make_simulator("cuda", config, maps, {{0, 10, 0}});
  run_same(make_simulator("cpu", config, maps, {{0, 10, 0}}).get(), cuda.get(), 10, 10);
  const std::vector<uint8_t> before = cuda->save();
  cuda->reserve(capacity_of(maps, many));
  EXPECT_EQ(cuda->save(), before);
  const uint64_t generation = cuda->generation();
  const AgentBox* const boxes = cuda->scene().agents.data();
  const std::vector<std::pair<CompiledMaps, std::vector<WorldSpec>>> batches{
      {maps, many}, {{maps[1]}, {{0, 30, 7}}}, {{maps[2], maps[0]}, {{1, 30, 7}, {0, 120, 8}}}, {maps, many}};
  for (uint64_t seed = 0; seed < batches.size(); ++seed) {
    const auto& [its_maps, worlds] = batches[seed];
    {
      const test::ForbidAllocations forbidden;
      cuda->set_worlds(its_maps, {}, worlds, seed);
    }
    SimulatorConfig same = config;
    same.seed = seed;
    run_same(make_simulator("cpu", same, its_maps, worlds).get(), cuda.get(), 60, 20);
  }
  EXPECT_EQ(cuda->generation(), generation);
  EXPECT_EQ(cuda->scene().agents.data(), boxes);
}

TEST_F(CudaSimulatorTest, ASnapshotKeepsItsState) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 30;
  const Maps maps{load_map("procedural:1")};
  const std::vector<WorldSpec> worlds = draw_worlds(3, 300, 1, 60, 1);
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  run_same(cpu.get(), cuda.get(), 40, 40);
  const auto on_host = cpu->snapshot(), on_device = cuda->snapshot();
  run_same(cpu.get(), cuda.get(), 40, 40, 40);
  cpu->restore(*on_host);
  cuda->restore(*on_device);
  run_same(cpu.get(), cuda.get(), 60, 20, 40);
  EXPECT_THROW(cuda->restore(*on_host), Error);
}

TEST_F(CudaSimulatorTest, BeginsChosenWorldsAndSetsChosenAgents) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 50;
  const Maps maps{load_map("procedural:1"), load_map("procedural:2")};
  const std::vector<WorldSpec> worlds = draw_worlds(5, 2000, 1, 60, 2);
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  const int num_slots = cpu->num_slots();
  for (uint32_t round = 0; round < 12; ++round) {
    SCOPED_TRACE(round);
    const testing::RandomEdit edit(cpu->state(), num_slots, round);
    cpu->set_state(edit.slots(), edit.fields());
    const DeviceEdit device_edit(edit, cuda->device());
    cuda->set_state(device_edit.slots(), device_edit.fields());
    expect_same_view(cpu.get(), cuda.get(), 0);
    if (round % 2 == 1) {
      std::vector<uint8_t> mask(worlds.size());
      for (size_t w = 0; w < mask.size(); ++w) mask[w] = (w + round) % 3 == 0;
      const DeviceBuffer<uint8_t> device_mask{Span<const uint8_t>(mask)};
      cpu->reset(mask, round);
      cuda->reset(Array(device_mask.data(), {static_cast<int64_t>(mask.size())}, cuda->device()), round);
    }
    run_same(cpu.get(), cuda.get(), 20, 10, 20 * round);
  }
}

TEST_F(CudaSimulatorTest, RefusesAWrongEditAsTheCpuDoes) {
  const Maps maps{load_map("procedural:1")};
  const std::vector<WorldSpec> worlds{{0, 40, 0}};
  const auto cpu = make_simulator("cpu", {}, maps, worlds);
  const auto cuda = make_simulator("cuda", {}, maps, worlds);
  const std::vector<uint8_t> before = cuda->save();
  const std::vector<int32_t> slots{3, 5, 3};
  const std::vector<float> x_m{1, NAN, 2};
  const DeviceBuffer<int32_t> device_slots{Span<const int32_t>(slots)};
  const DeviceBuffer<float> device_x_m{Span<const float>(x_m)};
  const std::string expected =
      test::message_of([&] { cpu->set_state(slots, std::vector<NamedArray>{{"x_m", Array(x_m)}}); });
  cuda->set_state(Array(device_slots.data(), {3}, cuda->device()),
                  std::vector<NamedArray>{{"x_m", Array(device_x_m.data(), {3}, cuda->device())}});
  EXPECT_EQ(test::message_of([&] { cuda->check(); }),
            "set_state: in an earlier call: " + expected.substr(std::string("set_state: ").size()));
  EXPECT_EQ(cuda->save(), before);
  EXPECT_THAT(test::message_of([&] { cuda->set_state(slots, {}); }), HasSubstr("on cuda:0, got i32 [3] on cpu"));
}

/// Queries in device memory, and arrays for their answers.
class DeviceQueries {
 public:
  DeviceQueries(const testing::RandomQueries& drawn, testing::AnswerMemory* first_values)
      : queries_(Span<const ObservationQuery>(drawn.queries)),
        hidden_(Span<const int32_t>(drawn.hidden)),
        inserted_(Span<const InsertedBox>(drawn.inserted)) {
#define X(name, type, rows, features, part, comment) \
  name##_ = DeviceBuffer<type>(Span<const type>(first_values->view().name));
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  }
  void ask(Simulator* cuda, Stream stream = {}) {
    cuda->observe(queries_.span(), hidden_.span(), inserted_.span(), out(), stream);
  }
  ObservationView out() {
#define X(name, type, rows, features, part, comment) {name##_.data(), name##_.size()},
    return {PICTURA_OBSERVATION_ARRAYS(X)};
#undef X
  }

 private:
  DeviceBuffer<ObservationQuery> queries_;
  DeviceBuffer<int32_t> hidden_;
  DeviceBuffer<InsertedBox> inserted_;
#define X(name, type, rows, features, part, comment) DeviceBuffer<type> name##_;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

TEST_F(CudaSimulatorTest, AnswersQueriesAsTheCpuDoes) {
  const Maps maps{load_map("procedural:1"), load_map("procedural:2")};
  const std::vector<WorldSpec> worlds = draw_worlds(3, 400, 1, 120, 2);
  for (uint32_t kind = 0; kind < 4; ++kind) {
    SCOPED_TRACE(kind);
    SimulatorConfig config;
    config.auxiliary_observations = kind % 2 == 0;
    config.wall_observations = kind < 2;
    config.vector_observations = kind < 3;
    const auto cpu = make_simulator("cpu", config, maps, worlds);
    const auto cuda = make_simulator("cuda", config, maps, worlds);
    run_same(cpu.get(), cuda.get(), 40, 40);
    const testing::RandomQueries drawn(cpu.get(), 2000, kind);
    testing::AnswerMemory answers(drawn.queries.size(), config);
    DeviceQueries on_device(drawn, &answers);
    cpu->observe(drawn.queries, drawn.hidden, drawn.inserted, answers.view());
    on_device.ask(cuda.get());
    cuda->check();
    EXPECT_EQ(testing::first_difference(answers.view(), HostObservation(on_device.out()).view()), "");
    expect_same_view(cpu.get(), cuda.get(), 40);
  }
}

TEST_F(CudaSimulatorTest, AGraphAnswersQueries) {
  const Maps maps{load_map("procedural:1")};
  const std::vector<WorldSpec> worlds = draw_worlds(3, 100, 1, 60, 1);
  const auto cpu = make_simulator("cpu", {}, maps, worlds);
  const auto cuda = make_simulator("cuda", {}, maps, worlds);
  const testing::RandomQueries drawn(cpu.get(), 100, 1);
  testing::AnswerMemory answers(drawn.queries.size(), cpu->config());
  DeviceQueries on_device(drawn, &answers);
  cudaStream_t stream = nullptr;
  PICTURA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  cudaGraph_t graph = nullptr;
  PICTURA_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
  on_device.ask(cuda.get(), {stream});
  PICTURA_CUDA(cudaStreamEndCapture(stream, &graph));
  cudaGraphExec_t executable = nullptr;
  PICTURA_CUDA(cudaGraphInstantiate(&executable, graph, 0));
  for (uint32_t round = 0; round < 3; ++round) {
    step_same(cpu.get(), cuda.get(), 10, 10 * round);
    PICTURA_CUDA(cudaGraphLaunch(executable, stream));
    cuda->check({stream});
    cpu->observe(drawn.queries, drawn.hidden, drawn.inserted, answers.view());
    EXPECT_EQ(testing::first_difference(answers.view(), HostObservation(on_device.out()).view()), "") << round;
  }
  PICTURA_CUDA(cudaGraphExecDestroy(executable));
  PICTURA_CUDA(cudaGraphDestroy(graph));
  PICTURA_CUDA(cudaStreamDestroy(stream));
}

TEST_F(CudaSimulatorTest, RefusesAWrongQueryAsTheCpuDoes) {
  const Maps maps{load_map("procedural:1")};
  const std::vector<WorldSpec> worlds{{0, 20, 0}, {0, 20, 1}};
  const auto cpu = make_simulator("cpu", {}, maps, worlds);
  const auto cuda = make_simulator("cuda", {}, maps, worlds);
  testing::RandomQueries drawn(cpu.get(), 30, 1);
  drawn.queries[7].slot = 3;
  drawn.queries[7].hidden_begin = 0;
  drawn.queries[7].hidden_end = static_cast<int32_t>(drawn.hidden.size());
  drawn.queries[20].slot = -5;
  testing::AnswerMemory answers(drawn.queries.size(), cpu->config());
  DeviceQueries on_device(drawn, &answers);
  const std::string expected =
      test::message_of([&] { cpu->observe(drawn.queries, drawn.hidden, drawn.inserted, answers.view()); });
  EXPECT_THAT(expected, HasSubstr("observe: query 7: hidden: expected boxes of the slot's own world"));
  on_device.ask(cuda.get());
  EXPECT_EQ(test::message_of([&] { cuda->check(); }),
            "observe: in an earlier call: " + expected.substr(std::string("observe: ").size()));
  EXPECT_EQ(testing::first_difference(answers.view(), HostObservation(on_device.out()).view()), "")
      << "nothing is written";
  ObservationView out = on_device.out();
  out.lanes = {out.lanes.data() + 1, out.lanes.size()};
  EXPECT_EQ(test::message_of([&] { cuda->observe(Span<const ObservationQuery>(nullptr, 30), {}, {}, out); }),
            "observe: out: lanes: expected an address that is a multiple of 16 bytes");
}

TEST_F(CudaSimulatorTest, TakesCommandsAndControllersInAGraph) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 50;
  const Maps maps{load_map("procedural:1")};
  const std::vector<WorldSpec> worlds = draw_worlds(3, 300, 1, 60, 1);
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  for (uint32_t step = 0; step < 100; ++step) {
    const std::vector<Command> commands = testing::mixed_commands(cpu->state(), 300, step);
    const DeviceBuffer<Command> on_device{Span<const Command>(commands)};
    cpu->step(commands);
    cuda->step(on_device.span());
    cuda->check();
  }
  expect_same_view(cpu.get(), cuda.get(), 100);
  const auto cpu_controller = make_controller("random", *cpu, 5), cuda_controller = make_controller("random", *cuda, 5);
  std::vector<Command> host_commands(300);
  DeviceBuffer<Command> commands(300);
  cudaStream_t stream = nullptr;
  PICTURA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  cudaGraph_t graph = nullptr;
  PICTURA_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
  cuda_controller->act(cuda->arrays(), {}, {commands.data(), 300}, {stream});
  cuda->step(commands.span(), {stream});
  PICTURA_CUDA(cudaStreamEndCapture(stream, &graph));
  cudaGraphExec_t executable = nullptr;
  PICTURA_CUDA(cudaGraphInstantiate(&executable, graph, 0));
  for (int step = 0; step < 100; ++step) {
    PICTURA_CUDA(cudaGraphLaunch(executable, stream));
    cpu_controller->act(cpu->arrays(), {}, host_commands);
    cpu->step(host_commands);
  }
  cuda->check({stream});
  expect_same_view(cpu.get(), cuda.get(), 200);
  PICTURA_CUDA(cudaGraphExecDestroy(executable));
  PICTURA_CUDA(cudaGraphDestroy(graph));
  PICTURA_CUDA(cudaStreamDestroy(stream));
}

TEST_F(CudaSimulatorTest, IsDrivenByTheLaneKeeperOnTheHost) {
  SimulatorConfig config = whole_world();
  config.episode_steps = 60;
  const Maps maps{load_map("procedural:1")};
  const std::vector<WorldSpec> worlds = draw_worlds(3, 200, 1, 60, 1);
  const auto cpu = make_simulator("cpu", config, maps, worlds);
  const auto cuda = make_simulator("cuda", config, maps, worlds);
  const auto cpu_controller = make_controller("lane", *cpu, 0), cuda_controller = make_controller("lane", *cuda, 0);
  EXPECT_EQ(cpu_controller->name(), "lane");
  EXPECT_EQ(cuda_controller->name(), "lane, on the host");
  // Commands of the other agents are unchanged.
  std::vector<uint8_t> mask(200, 1);
  mask[7] = 0;
  const DeviceBuffer<uint8_t> device_mask{Span<const uint8_t>(mask)};
  std::vector<Command> commands(200);
  DeviceBuffer<Command> device_commands{Span<const Command>(commands)};
  for (int step = 0; step < 150; ++step) {
    cpu_controller->act(cpu->arrays(), mask, commands);
    cuda_controller->act(cuda->arrays(), device_mask.span(), {device_commands.data(), 200});
    cpu->step(commands);
    cuda->step(device_commands.span());
  }
  cuda->check();
  expect_same_view(cpu.get(), cuda.get(), 150);
  EXPECT_GT(cpu->totals().waypoints_reached, 0);
}

TEST_F(CudaSimulatorTest, IsDrivenByInverseActionsAndTheDriverModel) {
  const auto scene = test::crossing({.num_steps = 60});
  SimulatorConfig config = scene_config(*scene);
  config.episode_steps = 70;  // longer than the record
  const CompiledMaps maps{compile_scenario(scene, map_options(config)),
                          compile_scenario(scene, map_options(config), 20)};
  const std::vector<WorldSpec> worlds{scene_world(*maps[0], 0, 0), scene_world(*maps[1], 1, 1)};
  for (const auto& [name, on_device] : {std::pair{"inverse", "inverse"}, std::pair{"idm", "idm, on the host"},
                                        std::pair{"idm_lanes", "idm_lanes, on the host"}}) {
    const auto cpu = make_simulator("cpu", config, maps, worlds), cuda = make_simulator("cuda", config, maps, worlds);
    const auto cpu_controller = make_controller(name, *cpu, 0), cuda_controller = make_controller(name, *cuda, 0);
    EXPECT_EQ(cuda_controller->name(), on_device);
    const auto num_slots = static_cast<size_t>(cpu->num_slots());
    std::vector<uint8_t> mask(num_slots, 1);
    mask[2] = 0;
    const DeviceBuffer<uint8_t> device_mask{Span<const uint8_t>(mask)};
    std::vector<Command> commands(num_slots, Command{.kind = CommandKind::recorded});
    const DeviceBuffer<Command> device_commands{Span<const Command>(commands)};
    for (int step = 0; step < 150; ++step) {
      cpu_controller->act(cpu->arrays(), mask, commands);
      cuda_controller->act(cuda->arrays(), device_mask.span(), {device_commands.data(), num_slots});
      cpu->step(commands);
      cuda->step(device_commands.span());
    }
    cuda->check();
    expect_same_view(cpu.get(), cuda.get(), 150);
    EXPECT_GT(cpu->totals().agent_steps, 0);
  }
}

TEST_F(CudaSimulatorTest, AnActionOutOfRangeChangesNothingAndIsReportedLater) {
  const auto cuda = make_simulator("cuda", {}, {load_map("procedural:1")}, {{0, 30, 0}, {0, 10, 1}});
  std::vector<int32_t> actions(40, 7);
  actions[33] = kNumActions;
  const uint64_t before = cuda->state_hash();
  const DeviceBuffer<int32_t> bad{Span<const int32_t>(actions)};
  EXPECT_NO_THROW(cuda->step(array_of(bad, *cuda)));
  EXPECT_EQ(cuda->state_hash(), before);
  try {
    cuda->check();
    ADD_FAILURE() << "expected the refusal of the earlier call";
  } catch (const Error& error) {
    EXPECT_THAT(error.what(), HasSubstr("slot 33: expected an action in [0, 12), got 12"));
  }
  actions[33] = 0;
  const DeviceBuffer<int32_t> good{Span<const int32_t>(actions)};
  cuda->step(array_of(good, *cuda));
  EXPECT_NO_THROW(cuda->check());
  EXPECT_NE(cuda->state_hash(), before);
}

TEST_F(CudaSimulatorTest, ActionArraysOfWrongTypeOrSizeAreRefusedAtOnce) {
  const auto cuda = make_simulator("cuda", {}, {load_map("procedural:1")}, {{0, 40, 0}});
  const uint64_t before = cuda->state_hash();
  const Device device = cuda->device();
  const DeviceBuffer<int32_t> actions(80);
  const DeviceBuffer<float> floats(40);
  const std::string expected = fmt::format("step: actions: expected i32 [40] on {}, got ", name_of(device));
  const auto refusal = [&](const Array& array) { return test::message_of([&] { cuda->step(array); }); };
  EXPECT_EQ(refusal({floats.data(), {40}, device}), expected + "f32 [40] on " + name_of(device));
  EXPECT_EQ(refusal({actions.data(), {39}, device}), expected + "i32 [39] on " + name_of(device));
  EXPECT_EQ(refusal(std::vector<int32_t>(40)), expected + "i32 [40] on cpu");
  const Device other{MemorySpace::cuda, device.index + 1};
  EXPECT_EQ(refusal({actions.data(), {40}, other}), expected + "i32 [40] on " + name_of(other));
  Array every_second = array_of(actions, *cuda);
  every_second.strides = {2};
  EXPECT_EQ(refusal(every_second), expected + "i32 [40] on " + name_of(device) + " with strides [2]");
  EXPECT_EQ(test::message_of([&] { cuda->step(Span<const Command>(nullptr, 39)); }),
            "step: expected 40 commands, got 39");
  EXPECT_NO_THROW(cuda->check());
  EXPECT_EQ(cuda->state_hash(), before);
}

}  // namespace
}  // namespace pictura
