// Actions that are held for several steps: the steps in which agents decide, the return of a decision, and driving as
// in training.
#include <cmath>
#include <random>

#include <gmock/gmock.h>

#include "pictura/backends/make_controller.h"
#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/error.h"
#include "pictura/map/load_map.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/policy/decision_clock.h"
#include "pictura/policy/session.h"
#include "pictura/tests/map/open_roads.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"
#include "pictura/training/collector.h"

namespace pictura {
namespace {

using ::testing::ElementsAre;
using ::testing::HasSubstr;

// Steps of one agent, with the value of its observation after the last step.
struct Steps {
  std::vector<float> rewards, values;
  std::vector<uint8_t> terminated, truncated, valid, decides;
};

std::vector<float> advantages_of(const Steps& steps, float gamma, float gae_lambda) {
  std::vector<float> advantages(steps.rewards.size());
  make_learner_executor(Device{})->compute_advantages(
      {steps.rewards, steps.values, steps.terminated, steps.truncated, steps.valid, steps.decides,
       static_cast<int64_t>(steps.rewards.size()), 1},
      gamma, gae_lambda, advantages);
  return advantages;
}

TEST(HeldActions, ReturnTheSumOfDiscountedRewards) {
  // Gamma .5, lambda .5: decisions at 0, 2 and 5; the rollout ends within the last one's hold.
  Steps steps{{1, 2, 4, 8, 16, 32}, {10, 0, 20, 0, 0, 30, 40}, {0, 0, 0, 0, 0, 0},
              {0, 0, 0, 0, 0, 0},   {1, 1, 1, 1, 1, 1},        {1, 0, 1, 0, 0, 1}};
  const float third = 32 + .5f * 40 - 30;
  const float second = 4 + .5f * 8 + .25f * 16 + .125f * 30 - 20 + .125f * .5f * third;
  const float first = 1 + .5f * 2 + .25f * 20 - 10 + .25f * .5f * second;
  EXPECT_THAT(advantages_of(steps, .5f, .5f), ElementsAre(first, 0, second, 0, 0, third));
  // A halt within the second hold.
  steps.terminated[3] = 1;
  steps.valid[4] = steps.valid[5] = 0;
  const float halted = 4 + .5f * 8 - 20;
  EXPECT_THAT(advantages_of(steps, .5f, .5f),
              ElementsAre(1 + .5f * 2 + .25f * 20 - 10 + .125f * halted, 0, halted, 0, 0, 0));
  // The episode is truncated there instead: step 4 resets the world, and its row is the final observation, of value 7.
  steps.terminated[3] = 0;
  steps.truncated[3] = 1;
  steps.values[4] = 7;
  steps.valid[5] = 1;
  const float cut_off = 4 + .5f * 8 + .25f * 7 - 20;
  EXPECT_THAT(advantages_of(steps, .5f, .5f),
              ElementsAre(1 + .5f * 2 + .25f * 20 - 10 + .125f * cut_off, 0, cut_off, 0, 0, third));
}

TEST(HeldActions, AreChosenAgainAtIntervalsAndEpisodeStarts) {
  SimulatorConfig config;
  config.episode_steps = 4;
  config.reset_inactive_fraction = 2;
  config.walls = false;
  const std::unique_ptr<Simulator> simulator =
      make_simulator("cpu", config, {load_map("procedural")}, {WorldSpec{0, 5, 1}});
  simulator->reset();
  const std::vector<int32_t> idle(5, 7);
  const std::unique_ptr<LearnerExecutor> executor = make_learner_executor(Device{});
  DecisionClock clock(3);
  std::string deciding;
  for (int64_t step = 0; step < 12; ++step) {
    const SimulatorArrays input = simulator->arrays();
    const at::Tensor active = active_slots(input, {}, true, executor.get());
    const int64_t count = clock.select_deciding(input, active, step, /*decides_at_end=*/true, executor.get()).size(0);
    EXPECT_TRUE(count == 0 || count == active.size(0)) << step;
    deciding += count > 0 ? 'd' : 'h';
    simulator->step(Array(idle));
  }
  // Step 4 shows the episode's final observation, which is valued, and step 5 the start of the next episode.
  EXPECT_EQ(deciding, "dhhddddhhddh");
}

TEST(HeldActions, AreChosenAgainAtTheStartOfALife) {
  SimulatorConfig config;
  config.num_threads = 1;
  config.pedestrian_fraction = config.cyclist_fraction = 0;
  config.parked_cars = 0;
  const auto street = std::make_shared<RoadMap>(parse_opendrive(test::open_street(120), "street.xodr"));
  const std::unique_ptr<Simulator> simulator = make_simulator("cpu", config, {street}, {WorldSpec{0, 6, 0}});
  const std::unique_ptr<Controller> driver = make_controller("idm_lanes", *simulator, 0);
  const std::unique_ptr<LearnerExecutor> executor = make_learner_executor(Device{});
  std::vector<Command> commands(6);
  DecisionClock clock(50);
  int begun = 0, left = 0;
  for (int64_t step = 0; step < 400; ++step) {
    const SimulatorArrays input = simulator->arrays();
    const at::Tensor deciding = clock.select_deciding(input, active_slots(input, {}, true, executor.get()), step,
                                                      /*decides_at_end=*/false, executor.get());
    std::vector<bool> decides(6);
    for (int64_t i = 0; i < deciding.size(0); ++i) decides[deciding[i].item<int64_t>()] = true;
    for (size_t slot = 0; slot < decides.size(); ++slot) {
      const bool begins = input.state.life[slot] > 0 && input.state.life_step[slot] == input.episode_step[0];
      const bool leaves = input.state.left[slot] != 0;
      begun += begins;
      left += leaves;
      if (step % 50 == 0) continue;
      EXPECT_EQ(decides[slot], begins || leaves) << slot << " at " << step;
    }
    driver->act(input, {}, commands);
    simulator->step(Span<const Command>(commands));
  }
  EXPECT_GT(begun, 4);
  EXPECT_GT(left, 4);
}

std::vector<std::string> held(const char* modality) {
  return {modality, "policy.decision_steps=3", "simulator.episode_steps=8"};
}

TEST(HeldActions, AreStoredInARollout) {
  const test::ScratchFolder folder;
  const TrainOptions options = test::small_run(folder / "run", "cpu", held("policy.modality=vector"));
  pictura::Run run(load_config(options.config_path, options.overrides), Device{});
  run.simulator->reset();
  Collector collector(&run);
  ASSERT_TRUE(collector.collect());
  const Rollout& rollout = run.rollout;
  int64_t num_held = 0, num_final = 0;
  for (int64_t step = 0; step < rollout.num_steps(); ++step) {
    for (int64_t slot = 0; slot < rollout.num_slots(); ++slot) {
      const auto at = [&](const at::Tensor& t, int64_t row) { return t[row][slot].item<float>(); };
      const bool decides = at(rollout.decides, step) != 0;
      if (step % 3 == 0 && at(rollout.valid, step) != 0) {
        EXPECT_TRUE(decides);
      }
      if (!decides && at(rollout.valid, step) != 0) {
        ++num_held;
        EXPECT_EQ(at(rollout.actions, step), at(rollout.actions, step - 1));
      }
      if (at(rollout.truncated, step) != 0 && step + 1 < rollout.num_steps()) {
        ++num_final;
        EXPECT_NE(at(rollout.values, step + 1), 0) << "of the final observation";
        EXPECT_EQ(at(rollout.decisions(), step + 1), 0) << "nothing is learned from a reset";
      }
    }
  }
  EXPECT_GT(num_held, 20);
  EXPECT_GT(num_final, 2);
}

TEST(HeldActions, ResumesExactly) {
  for (const char* modality : {"policy.modality=vector", "policy.modality=perspective"}) {
    const test::ScratchFolder folder;
    const auto [whole, again, resumed] = test::policies_of_equal_runs(folder / "runs", "cpu", held(modality));
    EXPECT_EQ(whole, again);
    EXPECT_EQ(whole, resumed);
  }
}

TEST(HeldActions, AreHeldByEveryDrivingPolicy) {
  const test::ScratchFolder folder;
  TrainOptions options = test::small_run(folder / "run", "cpu", held("policy.modality=vector"));
  options.overrides.push_back("train.updates=1");
  PolicySession session(train(options).checkpoint, {.num_threads = 1});
  const std::unique_ptr<Simulator> simulator =
      make_simulator("cpu", session.evaluation_world(9), {load_map("procedural")}, {WorldSpec{0, 6, 5}});
  simulator->reset();
  const std::unique_ptr<PolicyController> controller = session.make_controller(nullptr, /*argmax=*/false, 1);
  std::vector<Command> commands(6), before;
  bool changes = false;
  for (int step = 0; step < 9; ++step) {
    before = commands;
    controller->act(simulator->arrays(), {}, commands);
    EXPECT_EQ(controller->num_driven(), 6);
    for (size_t slot = 0; slot < 6; ++slot) {
      if (step % 3 != 0) {
        EXPECT_EQ(commands[slot].action, before[slot].action) << step;
      }
      changes |= step % 3 == 0 && step > 0 && commands[slot].action != before[slot].action;
    }
    simulator->step(commands);
  }
  EXPECT_TRUE(changes);
}

TEST(HeldActions, StepsDivideARollout) {
  EXPECT_THAT(
      test::message_of([] { parse_config("[policy]\ndecision_steps = 3\n[train]\nnum_steps = 64\n", "a.toml"); }),
      HasSubstr("train.num_steps: expected a multiple of policy.decision_steps (3), got 64"));
}

}  // namespace
}  // namespace pictura
