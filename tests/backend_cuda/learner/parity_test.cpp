// The learner's work other than its network, on a CUDA device: the rules over rollouts and the scenes that a rollout
// records give the bits of the host. Without a device, the tests are skipped; if PICTURA_REQUIRE_GPU is 1, they fail
// instead.
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>

#include <fmt/format.h>
#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_scene.h"
#include "pictura/map/load_map.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/backend_cuda/on_host.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/training/rules/advantage_filter.h"

namespace pictura {
namespace {

using test::CapturedGraph;
using test::message_of;
using test::on_host;
using test::OwnStream;
using ::testing::HasSubstr;

constexpr Device kDevice{MemorySpace::cuda, 0};
constexpr int kSlots = 400;

class CudaLearnerTest : public test::DeviceTest {};
class CudaSceneHistoryTest : public test::DeviceTest {};

template <typename T>
DeviceBuffer<T> on_device(const std::vector<T>& host) {
  return DeviceBuffer<T>(Span<const T>(host));
}
template <typename T>
Span<T> room_in(const DeviceBuffer<T>& buffer) {
  return {buffer.data(), buffer.size()};
}
template <typename T>
bool same_bits(const std::vector<T>& host, const DeviceBuffer<T>& device) {
  return test::same(Span<const T>(host), device.span());
}

/// Equal worlds, simulated on the host and on the device.
struct Worlds {
  std::unique_ptr<Simulator> cpu, cuda;

  explicit Worlds(const SimulatorConfig& config) {
    const CompiledMaps maps = compile_maps({load_map("procedural:1"), load_map("procedural:2")}, map_options(config));
    const std::vector<WorldSpec> worlds = draw_worlds(3, kSlots, 1, 60, 2);
    cpu = make_simulator("cpu", config, maps, worlds);
    cuda = make_simulator("cuda", config, maps, worlds);
  }

  void step(const std::vector<int32_t>& actions, Stream stream = {}) {
    const DeviceBuffer<int32_t> copy = on_device(actions);
    PICTURA_CUDA(cudaDeviceSynchronize());
    cpu->step(actions);
    cuda->step(Array(copy.data(), {kSlots}, cuda->device()), stream);
    cuda->check(stream);
  }
  /// Drives the worlds by mixed actions until `steps` steps have been done in total.
  void drive_to(uint32_t steps, Stream stream = {}) {
    for (; done_ < steps; ++done_) step(testing::mixed_actions(kSlots, done_), stream);
  }
  /// Removes all agents from their episodes.
  void remove_all() {
    const std::vector<Command> commands(kSlots, Command{.kind = CommandKind::absent});
    const DeviceBuffer<Command> copy = on_device(commands);
    cpu->step(Span<const Command>(commands));
    cuda->step(copy.span());
    cuda->check();
  }

 private:
  uint32_t done_ = 0;
};

/// Returns a configuration whose episodes never end, so that more and more agents have halted.
SimulatorConfig one_episode() { return {.reset_inactive_fraction = 2.0f}; }
/// Returns a configuration whose episodes end after 20 steps, or earlier where many agents have halted.
SimulatorConfig short_episodes() { return {.episode_steps = 20}; }

struct Executors {
  std::unique_ptr<LearnerExecutor> host = make_learner_executor(Device{}), device = make_learner_executor(kDevice);
};

std::vector<uint8_t> random_flags(size_t size, double probability, std::mt19937_64* random) {
  std::bernoulli_distribution draw(probability);
  std::vector<uint8_t> flags(size);
  for (uint8_t& flag : flags) flag = draw(*random);
  return flags;
}

std::vector<float> random_numbers(size_t size, std::mt19937_64* random) {
  std::normal_distribution<float> draw;
  std::vector<float> numbers(size);
  for (float& number : numbers) number = draw(*random);
  return numbers;
}

std::vector<int64_t> random_items(size_t size, std::mt19937_64* random) {
  std::vector<int64_t> items(size);
  for (int64_t& item : items) item = static_cast<int64_t>((*random)() >> 1);
  return items;
}

/// Returns log probabilities of `rows` agents. In every fifth row all actions are equal, so several are the maximum.
std::vector<float> random_log_probs(size_t rows, std::mt19937_64* random) {
  std::vector<float> result = random_numbers(rows * kNumActions, random);
  for (size_t row = 0; row < rows; ++row) {
    float* const logits = result.data() + row * kNumActions;
    if (row % 5 == 0) std::fill(logits, logits + kNumActions, 0.0f);
    double sum = 0;
    for (int i = 0; i < kNumActions; ++i) sum += std::exp(static_cast<double>(logits[i]));
    for (int i = 0; i < kNumActions; ++i) logits[i] -= static_cast<float>(std::log(sum));
  }
  return result;
}

/// Returns the host's selection, after checking that the device's is the same.
template <typename Select>
std::vector<int64_t> same_selection(size_t room, const Executors& executors, const Select& select) {
  std::vector<int64_t> selected(room, -1);
  const DeviceBuffer<int64_t> on_the_device(room);
  selected.resize(select(executors.host.get(), Span<int64_t>(selected), /*on_device=*/false));
  const int64_t count = select(executors.device.get(), room_in(on_the_device), /*on_device=*/true);
  EXPECT_EQ(count, static_cast<int64_t>(selected.size()));
  if (count == static_cast<int64_t>(selected.size())) {
    EXPECT_EQ(on_host(Span<const int64_t>(on_the_device.data(), selected.size())), selected);
  }
  return selected;
}

std::vector<int64_t> same_active(const Worlds& worlds, const Executors& executors, const std::vector<uint8_t>& mask) {
  const DeviceBuffer<uint8_t> copy = on_device(mask);
  return same_selection(kSlots, executors, [&](LearnerExecutor* executor, Span<int64_t> slots, bool on_device) {
    return on_device ? executor->select_deciding({worlds.cuda->arrays().state.status, copy.span(), nullptr}, slots)
                     : executor->select_deciding({worlds.cpu->arrays().state.status, mask, nullptr}, slots);
  });
}

std::vector<int64_t> same_kept(const Executors& executors, const std::vector<float>& advantages,
                               const std::vector<uint8_t>& valid, float threshold) {
  const DeviceBuffer<float> advantage_copy = on_device(advantages);
  const DeviceBuffer<uint8_t> valid_copy = on_device(valid);
  return same_selection(
      advantages.size(), executors, [&](LearnerExecutor* executor, Span<int64_t> kept, bool on_device) {
        return on_device ? executor->select_kept(advantage_copy.span(), valid_copy.span(), threshold, kept)
                         : executor->select_kept(advantages, valid, threshold, kept);
      });
}

TEST_F(CudaLearnerTest, SelectsActiveSlotsInTheMask) {
  std::mt19937_64 random(1);
  const Executors executors;
  Worlds worlds(one_episode());
  size_t active = 0, active_before = kSlots + 1;
  for (const uint32_t steps : {0u, 60u, 180u}) {
    worlds.drive_to(steps);
    active = same_active(worlds, executors, {}).size();
    EXPECT_LT(active, active_before) << "more have halted after " << steps << " steps";
    active_before = active;
    EXPECT_EQ(same_active(worlds, executors, std::vector<uint8_t>(kSlots, 1)).size(), active);
    EXPECT_LT(same_active(worlds, executors, random_flags(kSlots, 0.5, &random)).size(), active);
    EXPECT_EQ(same_active(worlds, executors, std::vector<uint8_t>(kSlots, 0)).size(), 0u);
  }
  EXPECT_GT(active, 0u);
  worlds.remove_all();
  EXPECT_EQ(same_active(worlds, executors, {}).size(), 0u);
}

TEST_F(CudaLearnerTest, SelectsSlotsThatHoldNoAction) {
  std::mt19937_64 random(6);
  const Executors executors;
  Worlds worlds(short_episodes());
  size_t held = 0;
  for (const uint32_t steps : {1u, 13u, 20u, 21u}) {
    SCOPED_TRACE(steps);
    worlds.drive_to(steps);
    const std::vector<uint8_t> acted_before = random_flags(kSlots, 0.7, &random);
    const DeviceBuffer<uint8_t> copy = on_device(acted_before);
    const size_t active = same_active(worlds, executors, {}).size();
    for (const bool decides_at_end : {false, true}) {
      const auto select = [&](LearnerExecutor* executor, Span<int64_t> slots, bool on_device) {
        const SimulatorArrays& input = (on_device ? *worlds.cuda : *worlds.cpu).arrays();
        const HeldActions held_actions(input, on_device ? copy.data() : acted_before.data(), decides_at_end);
        return executor->select_deciding({input.state.status, {}, nullptr, held_actions}, slots);
      };
      const size_t deciding = same_selection(kSlots, executors, select).size();
      EXPECT_LE(deciding, active);
      held += active - deciding;
    }
  }
  EXPECT_GT(held, 0u);
}

TEST_F(CudaLearnerTest, ChoosesActionsOfSelectedSlots) {
  constexpr int32_t kUntouched = -7;
  std::mt19937_64 random(2);
  const Executors executors;
  Worlds worlds(short_episodes());
  std::vector<std::vector<int32_t>> all_drawn;
  for (const uint32_t steps : {0u, 1u, 13u, 47u}) {
    SCOPED_TRACE(steps);
    worlds.drive_to(steps);
    // Select slots in random order, and not all of them.
    std::vector<int64_t> slots = same_active(worlds, executors, random_flags(kSlots, 0.7, &random));
    std::shuffle(slots.begin(), slots.end(), random);
    const std::vector<float> log_probs = random_log_probs(slots.size(), &random);
    const DeviceBuffer<int64_t> slot_copy = on_device(slots);
    const DeviceBuffer<float> log_prob_copy = on_device(log_probs);
    const auto chosen = [&](const ActionChoice& choice) {
      std::vector<int32_t> actions(kSlots, kUntouched);
      const DeviceBuffer<int32_t> device_actions = on_device(actions);
      executors.host->choose_actions(worlds.cpu->arrays(), slots, log_probs, choice, actions);
      executors.device->choose_actions(worlds.cuda->arrays(), slot_copy.span(), log_prob_copy.span(), choice,
                                       room_in(device_actions));
      EXPECT_EQ(on_host(device_actions.span()), actions);
      return actions;
    };
    const std::vector<int32_t> likely = chosen({.argmax = true}), drawn = chosen({.argmax = false, .seed = 4}),
                               of_other_seed = chosen({.argmax = false, .seed = uint64_t{5} << 40});
    EXPECT_NE(drawn, likely);
    EXPECT_NE(drawn, of_other_seed);
    EXPECT_EQ(std::count(drawn.begin(), drawn.end(), kUntouched), kSlots - static_cast<int64_t>(slots.size()));
    all_drawn.push_back(drawn);
  }
  const std::vector<int32_t> episodes = on_host(worlds.cuda->episode_index());
  EXPECT_GT(*std::max_element(episodes.begin(), episodes.end()), 1);
}

TEST_F(CudaLearnerTest, WritesCommandsInTheMask) {
  std::mt19937_64 random(3);
  const Executors executors;
  std::vector<int32_t> actions(kSlots);
  for (int32_t& action : actions) action = static_cast<int32_t>(random() % kNumActions);
  const DeviceBuffer<int32_t> action_copy = on_device(actions);
  const std::vector<Command> before(
      kSlots, Command{.kind = CommandKind::kinematic_state, .action = 3, .x_m = 1, .y_m = 2, .z_m = 3, .speed_mps = 4});
  for (const std::vector<uint8_t>& mask : {std::vector<uint8_t>{}, random_flags(kSlots, 0.4, &random)}) {
    const DeviceBuffer<uint8_t> mask_copy = on_device(mask);
    std::vector<Command> commands = before;
    const DeviceBuffer<Command> device_commands = on_device(before);
    executors.host->write_commands(actions, mask, commands);
    executors.device->write_commands(action_copy.span(), mask_copy.span(), room_in(device_commands));
    EXPECT_TRUE(same_bits(commands, device_commands));
    EXPECT_EQ(std::count_if(commands.begin(), commands.end(),
                            [](const Command& command) { return command.kind == CommandKind::action; }),
              mask.empty() ? kSlots : std::count(mask.begin(), mask.end(), 1));
  }
}

/// Random transitions of a rollout on the host and the device.
struct Transitions {
  std::vector<float> rewards, values;
  std::vector<uint8_t> terminated, truncated, valid, decides;
  DeviceBuffer<float> reward_copy, value_copy;
  DeviceBuffer<uint8_t> terminated_copy, truncated_copy, valid_copy, decides_copy;
  int64_t num_steps, num_slots;

  Transitions(int64_t steps, int64_t slots, std::mt19937_64* random) : num_steps(steps), num_slots(slots) {
    const auto size = static_cast<size_t>(steps * slots);
    rewards = random_numbers(size, random);
    values = random_numbers(size + static_cast<size_t>(slots), random);
    terminated = random_flags(size, 0.05, random);
    truncated = random_flags(size, 0.05, random);
    valid = random_flags(size, 0.8, random);
    decides = random_flags(size, 0.4, random);
    reward_copy = on_device(rewards);
    value_copy = on_device(values);
    terminated_copy = on_device(terminated);
    truncated_copy = on_device(truncated);
    valid_copy = on_device(valid);
    decides_copy = on_device(decides);
  }
  TransitionArrays host() const {
    return {rewards, values, terminated, truncated, valid, decides, num_steps, num_slots};
  }
  TransitionArrays device() const {
    return {reward_copy.span(),
            value_copy.span(),
            terminated_copy.span(),
            truncated_copy.span(),
            valid_copy.span(),
            decides_copy.span(),
            num_steps,
            num_slots};
  }
};

TEST_F(CudaLearnerTest, ComputesAdvantages) {
  std::mt19937_64 random(4);
  const Executors executors;
  for (const auto& [steps, slots] : {std::pair{1, 1}, {37, 53}, {128, 4096}, {3, 70'001}}) {
    SCOPED_TRACE(fmt::format("{} steps of {} slots", steps, slots));
    const Transitions transitions(steps, slots, &random);
    std::vector<float> advantages(transitions.rewards.size());
    DeviceBuffer<float> device_advantages(advantages.size());
    device_advantages.fill(0xFF);
    executors.host->compute_advantages(transitions.host(), 0.99f, 0.95f, advantages);
    executors.device->compute_advantages(transitions.device(), 0.99f, 0.95f, room_in(device_advantages));
    EXPECT_TRUE(same_bits(advantages, device_advantages));
  }
}

TEST_F(CudaLearnerTest, CountsAdvantages) {
  std::mt19937_64 random(8);
  const Executors executors;
  for (const size_t size : {size_t{128 * 4096}, size_t{1}, size_t{0}, size_t{1000}}) {
    SCOPED_TRACE(size);
    std::vector<float> advantages = random_numbers(size, &random);
    if (size > 2) advantages[0] = std::numeric_limits<float>::infinity(), advantages[1] = std::nanf("");
    const std::vector<uint8_t> valid = random_flags(size, 0.8, &random);
    const DeviceBuffer<float> advantage_copy = on_device(advantages);
    const DeviceBuffer<uint8_t> valid_copy = on_device(valid);
    std::vector<int64_t> counts(kNumFilterBins, 3);
    const DeviceBuffer<int64_t> device_counts = on_device(counts);
    executors.host->count_advantages(advantages, valid, counts);
    executors.device->count_advantages(advantage_copy.span(), valid_copy.span(), room_in(device_counts));
    EXPECT_EQ(on_host(device_counts.span()), counts);
    EXPECT_EQ(std::accumulate(counts.begin(), counts.end(), int64_t{0}),
              3 * kNumFilterBins + std::count(valid.begin(), valid.end(), 1));
  }
}

TEST_F(CudaLearnerTest, SelectsTransitionsKeptByTheFilter) {
  std::mt19937_64 random(5);
  const Executors executors;
  for (const size_t size : {size_t{37 * 53}, size_t{128 * 4096}, size_t{1}, size_t{0}, size_t{1000}}) {
    SCOPED_TRACE(size);
    const std::vector<float> advantages = random_numbers(size, &random);
    const std::vector<uint8_t> valid = random_flags(size, 0.8, &random);
    const auto num_valid = static_cast<size_t>(std::count(valid.begin(), valid.end(), 1));
    EXPECT_EQ(same_kept(executors, advantages, valid, 0).size(), num_valid);
    const size_t middling = same_kept(executors, advantages, valid, 0.7f).size();
    if (size > 1) {
      EXPECT_GT(middling, size / 10);
      EXPECT_LT(middling, num_valid);
    }
    EXPECT_EQ(same_kept(executors, advantages, valid, 100).size(), 0u);
  }
}

TEST_F(CudaLearnerTest, Permutes) {
  std::mt19937_64 random(6);
  const Executors executors;
  for (const size_t size : {size_t{1}, size_t{2}, size_t{1000}, size_t{70'001}}) {
    SCOPED_TRACE(size);
    const std::vector<int64_t> items = random_items(size, &random);
    const DeviceBuffer<int64_t> item_copy = on_device(items), permuted_on_device(size);
    std::vector<int64_t> permuted(size);
    const Permutation permutation(uint64_t{9} << 33, 12, 3, static_cast<int64_t>(size));
    executors.host->permute(permutation, items, permuted);
    executors.device->permute(permutation, item_copy.span(), room_in(permuted_on_device));
    EXPECT_EQ(on_host(permuted_on_device.span()), permuted);
    EXPECT_TRUE(size < 1000 || permuted != items);
  }
}

TEST_F(CudaLearnerTest, SelectingAllocatesNothingAfterTheFirstCallOfASize) {
  std::mt19937_64 random(7);
  const Executors executors;
  const Worlds worlds(one_episode());
  constexpr size_t kMany = 128 * 4096;
  const std::vector<float> advantages = random_numbers(kMany, &random);
  const std::vector<uint8_t> valid(kMany, 1);
  const DeviceBuffer<float> advantage_copy = on_device(advantages);
  const DeviceBuffer<uint8_t> valid_copy = on_device(valid);
  const DeviceBuffer<int64_t> selected(kMany);
  const OwnStream own;
  const Stream stream{own.stream};
  const auto select = [&](size_t size) {
    return executors.device->select_kept(advantage_copy.span().subspan(0, size), valid_copy.span().subspan(0, size),
                                         0.5f, room_in(selected), stream);
  };
  const auto select_deciding = [&] {
    return executors.device->select_deciding({worlds.cuda->arrays().state.status, {}, nullptr},
                                             {selected.data(), kSlots}, stream);
  };
  const int64_t all = select(kMany), some = select(1000), active = select_deciding();
  // Selecting waits for its count, so that a capture could not detect this.
  const int64_t allocations = device_allocations;
  EXPECT_EQ(select(kMany), all);
  EXPECT_EQ(select(1000), some);
  EXPECT_EQ(select_deciding(), active);
  EXPECT_EQ(device_allocations, allocations);
}

// Captures reject every call that allocates or waits. Replayed work reads the simulator's state at the replay.
TEST_F(CudaLearnerTest, AllKernelsExceptSelectionAreCapturedIntoAGraph) {
  std::mt19937_64 random(8);
  const Executors executors;
  Worlds worlds(short_episodes());
  const OwnStream own;
  const Stream stream{own.stream};

  std::vector<int64_t> slots(kSlots);
  for (size_t i = 0; i < slots.size(); ++i) slots[i] = static_cast<int64_t>(i);
  const std::vector<float> log_probs = random_log_probs(kSlots, &random);
  const Transitions transitions(37, 53, &random);
  const std::vector<int64_t> items = random_items(1000, &random);
  const Permutation permutation(1, 2, 3, 1000);
  struct {
    std::vector<int32_t> actions = std::vector<int32_t>(kSlots);
    std::vector<Command> commands = std::vector<Command>(kSlots);
    std::vector<float> advantages = std::vector<float>(37 * 53);
    std::vector<int64_t> permuted = std::vector<int64_t>(1000);
  } host;
  struct {
    DeviceBuffer<int32_t> actions{kSlots};
    DeviceBuffer<Command> commands{kSlots};
    DeviceBuffer<float> advantages{37 * 53};
    DeviceBuffer<int64_t> permuted{1000};
  } device;
  const DeviceBuffer<int64_t> slot_copy = on_device(slots), item_copy = on_device(items);
  const DeviceBuffer<float> log_prob_copy = on_device(log_probs);
  PICTURA_CUDA(cudaDeviceSynchronize());

  const ActionChoice drawn{.argmax = false, .seed = 3};
  const auto work = [&] {
    LearnerExecutor& executor = *executors.device;
    executor.choose_actions(worlds.cuda->arrays(), slot_copy.span(), log_prob_copy.span(), drawn,
                            room_in(device.actions), stream);
    executor.write_commands(device.actions.span(), {}, room_in(device.commands), stream);
    executor.compute_advantages(transitions.device(), 0.9f, 0.8f, room_in(device.advantages), stream);
    executor.permute(permutation, item_copy.span(), room_in(device.permuted), stream);
  };
  work();
  const CapturedGraph graph(own.stream, work);
  std::vector<std::vector<int32_t>> all_actions;
  for (const uint32_t steps : {0u, 5u, 30u}) {
    SCOPED_TRACE(steps);
    worlds.drive_to(steps, stream);
    device.actions.fill(0xFF);
    device.commands.fill(0xFF);
    device.advantages.fill(0xFF);
    device.permuted.fill(0xFF);
    PICTURA_CUDA(cudaDeviceSynchronize());
    PICTURA_CUDA(cudaGraphLaunch(graph.executable, own.stream));
    executors.host->choose_actions(worlds.cpu->arrays(), slots, log_probs, drawn, host.actions);
    executors.host->write_commands(host.actions, {}, host.commands);
    executors.host->compute_advantages(transitions.host(), 0.9f, 0.8f, host.advantages);
    executors.host->permute(permutation, items, host.permuted);
    EXPECT_TRUE(same_bits(host.actions, device.actions));
    EXPECT_TRUE(same_bits(host.commands, device.commands));
    EXPECT_TRUE(same_bits(host.advantages, device.advantages));
    EXPECT_TRUE(same_bits(host.permuted, device.permuted));
    all_actions.push_back(host.actions);
  }
  EXPECT_NE(all_actions[0], all_actions[1]) << "the step is part of what is drawn from";
}

TEST_F(CudaLearnerTest, AnAbsentDeviceIsRefused) {
  const Device beyond{MemorySpace::cuda, 99};
  EXPECT_THROW(make_learner_executor(beyond), Error);
  EXPECT_THROW(make_scene_history(beyond, {.num_steps = 1}), Error);
  EXPECT_EQ(make_learner_executor(kDevice)->device(), kDevice);
  EXPECT_GT(make_learner_executor(kDevice)->memory_bytes(), int64_t{1} << 30);
}

/// Scenes of some steps on the host and the device, with memory for more steps.
struct Histories {
  std::unique_ptr<SceneHistory> host, device;

  Histories(const Worlds& worlds, int num_steps) {
    const SceneBatch& scene = worlds.cpu->scene();
    const SceneHistorySize size{num_steps, scene.geometry.size(), scene.agents.size(), scene.light_states.size(),
                                worlds.cpu->views().size()};
    host = make_scene_history(Device{}, size);
    device = make_scene_history(kDevice, size);
  }
  void put(int step, const Worlds& worlds, Stream stream = {}) {
    host->put(step, worlds.cpu->scene(), worlds.cpu->views());
    device->put(step, worlds.cuda->scene(), worlds.cuda->views(), stream);
  }
  void expect_same_scene() const {
    const SceneBatch a = host->scene(), b = device->scene();
    EXPECT_EQ(b.device, kDevice);
    EXPECT_TRUE(test::same(a.world_begin, b.world_begin) && test::same(a.light_begin, b.light_begin));
    EXPECT_TRUE(test::same(a.agents, b.agents) && test::same(a.geometry, b.geometry));
    EXPECT_TRUE(test::same(a.light_states, b.light_states));
    EXPECT_TRUE(b.hidden_agents.empty());
  }
};

/// Views of some rows on the host and the device.
struct GatheredViews {
  std::vector<View> host;
  DeviceBuffer<View> device;

  GatheredViews(const Histories& histories, const std::vector<int64_t>& rows) : host(rows.size()), device(rows.size()) {
    const DeviceBuffer<int64_t> row_copy = on_device(rows);
    histories.host->gather(rows, host);
    histories.device->gather(row_copy.span(), room_in(device));
    EXPECT_TRUE(same_bits(host, device));
  }
};

std::vector<int64_t> random_rows(size_t size, int64_t num_rows, std::mt19937_64* random) {
  std::uniform_int_distribution<int64_t> draw(0, num_rows - 1);
  std::vector<int64_t> rows(size);
  for (int64_t& row : rows) row = draw(*random);
  return rows;
}

TEST_F(CudaSceneHistoryTest, HoldsAndGathersTheSameAsOnTheHost) {
  constexpr int kSteps = 6;
  std::mt19937_64 random(9);
  Worlds worlds(short_episodes());
  Histories histories(worlds, kSteps);
  for (int step = 0; step < kSteps - 1; ++step) {
    worlds.drive_to(9 * static_cast<uint32_t>(step));
    histories.put(step, worlds);
    histories.expect_same_scene();
  }
  worlds.drive_to(60);
  histories.put(2, worlds);
  histories.expect_same_scene();
  // Include rows of the step that was not put, and rows of no step.
  std::vector<int64_t> rows = random_rows(5000, kSteps * kSlots, &random);
  rows.insert(rows.end(), {-1, (kSteps - 1) * kSlots - 1, (kSteps - 1) * kSlots, kSteps * kSlots, int64_t{1} << 40});
  const GatheredViews views(histories, rows);
  const auto is_nowhere = [](const View& view) { return view.world < 0; };
  const auto num_nowhere = std::count_if(views.host.begin(), views.host.end(), is_nowhere);
  EXPECT_GT(num_nowhere, 500);
  EXPECT_LT(num_nowhere, 1200);
}

/// A renderer with a simulator's maps, and memory for the images of a call.
struct Canvas {
  std::unique_ptr<Renderer> renderer;
  HostImages images;

  Canvas(const char* name, Device device, const Simulator& simulator, size_t num_views)
      : renderer(make_renderer(name, {.rig = paper_rig(), .device = device})),
        images(paper_rig(), static_cast<int>(num_views), PixelFormat::f32) {
    upload_maps(simulator, renderer.get());
  }
  /// Draws on the device. The images are the drawn ones even where errors are reported.
  void draw_on_device(const SceneBatch& scene, Span<const View> views) {
    DeviceImages device_images;
    const ImageBatch batch = device_images.like(images.batch());
    const Span<uint8_t> bytes = device_images.color_bytes();
    PICTURA_CUDA(cudaMemset(bytes.data(), 0xA5, bytes.size()));
    renderer->render(scene, views, batch);
    PICTURA_CUDA(cudaDeviceSynchronize());
    device_images.copy_to_host(images.batch());
    PICTURA_CUDA(cudaDeviceSynchronize());
  }
  std::vector<uint8_t> bytes() const { return {images.bytes().begin(), images.bytes().end()}; }
};

TEST_F(CudaSceneHistoryTest, ImagesOfAnyStepsMatchTheOracle) {
  constexpr int kSteps = 4;
  std::mt19937_64 random(10);
  Worlds worlds(short_episodes());
  Histories histories(worlds, kSteps);
  for (int step = 0; step < kSteps; ++step) {
    worlds.drive_to(9 * static_cast<uint32_t>(step));
    histories.put(step, worlds);
  }
  const GatheredViews views(histories, random_rows(60, kSteps * kSlots, &random));
  Canvas cpu("cpu", Device{}, *worlds.cpu, views.host.size());
  Canvas cuda("cuda", kDevice, *worlds.cuda, views.host.size());
  cpu.renderer->render(histories.host->scene(), views.host, cpu.images.batch());
  cuda.draw_on_device(histories.device->scene(), views.device.span());
  EXPECT_NO_THROW(cuda.renderer->check());
  EXPECT_EQ(cuda.bytes(), cpu.bytes());
  const std::vector<uint8_t> drawn = cpu.bytes();
  EXPECT_GT(std::count_if(drawn.begin(), drawn.end(), [](uint8_t byte) { return byte != 0; }), 10'000);
}

TEST_F(CudaSceneHistoryTest, AViewOfAMissingStepIsBlackAndReported) {
  Worlds worlds(short_episodes());
  Histories histories(worlds, 2);
  histories.put(0, worlds);
  const GatheredViews both(histories, {5, kSlots + 5}), sound(histories, {5});
  Canvas cpu("cpu", Device{}, *worlds.cpu, 1), cuda("cuda", kDevice, *worlds.cuda, 2);
  cpu.renderer->render(histories.host->scene(), sound.host, cpu.images.batch());
  cuda.draw_on_device(histories.device->scene(), both.device.span());
  EXPECT_THAT(message_of([&] { cuda.renderer->check(); }), HasSubstr("view 1: no such world"));
  std::vector<uint8_t> expected = cpu.bytes();
  expected.resize(2 * expected.size());  // black
  EXPECT_EQ(cuda.bytes(), expected);
}

TEST_F(CudaSceneHistoryTest, PuttingAndGatheringAreCapturedIntoAGraph) {
  std::mt19937_64 random(11);
  Worlds worlds(short_episodes());
  Histories histories(worlds, 2);
  const OwnStream own;
  const Stream stream{own.stream};
  const std::vector<int64_t> rows = random_rows(300, 2 * kSlots, &random);
  const DeviceBuffer<int64_t> row_copy = on_device(rows);
  const DeviceBuffer<View> views(rows.size());
  histories.put(0, worlds);
  histories.put(1, worlds);
  PICTURA_CUDA(cudaDeviceSynchronize());
  const CapturedGraph graph(own.stream, [&] {
    histories.device->put(1, worlds.cuda->scene(), worlds.cuda->views(), stream);
    histories.device->gather(row_copy.span(), room_in(views), stream);
  });
  for (const uint32_t steps : {10u, 30u}) {
    worlds.drive_to(steps, stream);
    PICTURA_CUDA(cudaGraphLaunch(graph.executable, own.stream));
    histories.host->put(1, worlds.cpu->scene(), worlds.cpu->views());
    std::vector<View> expected(rows.size());
    histories.host->gather(rows, expected);
    EXPECT_TRUE(same_bits(expected, views)) << steps;
    histories.expect_same_scene();
  }
}

TEST_F(CudaSceneHistoryTest, ScenesInHostMemoryAreRefused) {
  const Worlds worlds(short_episodes());
  const Histories histories(worlds, 1);
  EXPECT_EQ(message_of([&] { histories.device->put(0, worlds.cpu->scene(), worlds.cpu->views()); }),
            "scene history: expected a scene on cuda:0, got a scene on cpu");
}

}  // namespace
}  // namespace pictura
