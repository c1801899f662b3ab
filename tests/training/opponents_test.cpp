// Opponents, the agents that saved policies drive in a run's worlds: their choice, their actions, and that the policy
// does not learn from them.
#include "pictura/training/opponents.h"

#include <array>

#include <fmt/ranges.h>
#include <gmock/gmock.h>

#include "pictura/backends/make_learner.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/map/load_map.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"

namespace pictura {
namespace {

using ::testing::HasSubstr;

class OpponentsTest : public ::testing::Test {
 protected:
  std::string policy_of(const std::string& name, std::vector<std::string> settings) const {
    settings.insert(settings.end(), {"run.seed=5", "train.updates=1"});
    train(test::small_run(folder_ / name, "cpu", settings));
    return folder_ / (name + "/policy.safetensors");
  }
  static std::string others(const std::vector<std::string>& texts) {
    return fmt::format("simulator.others.policies=[\"{}\"]", fmt::join(texts, "\", \""));
  }

  const test::ScratchFolder folder_;
};

TEST_F(OpponentsTest, DriveTheirSharesAndTheLearnerTheOthers) {
  const std::string vectors = policy_of("vectors", {"policy.modality=vector", "policy.auxiliary=true",
                                                    "simulator.wall_observations=true"}),
                    images = policy_of("images", {});
  const Config config =
      load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml",
                  {"run.num_threads=1", "train.num_steps=12", others({vectors + "=0.3", images + "=0.3"})});
  Opponents opponents(config, {}, single_communicator());
  SimulatorConfig world = simulator_config(config);
  EXPECT_FALSE(world.vector_observations);
  opponents.add_arrays(&world);
  EXPECT_TRUE(world.vector_observations && world.auxiliary_observations && world.wall_observations);
  const auto simulator = make_simulator("cpu", world, {load_map("procedural")}, {{0, 60, 0}, {0, 60, 1}});
  opponents.enter(*simulator);
  const auto executor = make_learner_executor(Device{});
  const int num_slots = simulator->num_slots();

  SessionOptions options;
  options.num_threads = 1;
  options.device = "cpu";
  std::vector<std::unique_ptr<PolicySession>> sessions;
  std::vector<std::unique_ptr<Renderer>> renderers;
  std::vector<std::unique_ptr<PolicyController>> controllers;
  for (const std::string& path : {vectors, images}) {
    sessions.push_back(std::make_unique<PolicySession>(path, options));
    renderers.push_back(sessions.back()->make_renderer());
    if (renderers.back()) upload_maps(*simulator, renderers.back().get());
    controllers.push_back(sessions.back()->make_controller(renderers.back().get(), false, config.run.seed));
  }
  constexpr int32_t kOwn = 7;
  const std::vector<int32_t> own_actions(static_cast<size_t>(num_slots), kOwn);
  std::array<int, 3> driven{};
  for (int step = 0; step < 5; ++step) {
    const SimulatorArrays& input = simulator->arrays();
    const Span<const Command> commands = opponents.commands(input, own_actions, executor.get());
    const at::Tensor own = opponents.own_slots(input);
    std::vector<std::vector<Command>> expected(2, std::vector<Command>(own_actions.size()));
    for (size_t i = 0; i < 2; ++i) controllers[i]->act(input, {}, expected[i]);
    for (int slot = 0; slot < num_slots; ++slot) {
      const uint8_t driver = input.driver[slot];
      EXPECT_EQ(own[slot].item<uint8_t>(), driver == 0);
      if (input.state.status[slot] != AgentStatus::active) continue;
      ++driven[driver];
      EXPECT_EQ(commands[slot].kind, CommandKind::action);
      EXPECT_EQ(commands[slot].action, driver == 0 ? kOwn : expected[driver - 1][slot].action) << slot;
    }
    const StepResult result = simulator->step(commands);
    for (int slot = 0; slot < num_slots; ++slot) EXPECT_LE(result.valid[slot], input.driver[slot] == 0);
  }
  EXPECT_NEAR(driven[0] / (5.0 * num_slots), 0.4, 0.15);
  EXPECT_NEAR(driven[1] / (5.0 * num_slots), 0.3, 0.15);
  EXPECT_NEAR(driven[2] / (5.0 * num_slots), 0.3, 0.15);
}

TEST_F(OpponentsTest, AreExcludedFromLearning) {
  const std::string vectors = policy_of("vectors", {"policy.modality=vector"}), images = policy_of("images", {});
  for (const char* modality : {"vector", "perspective"}) {
    const auto learn = [&](const std::string& name, const std::vector<std::string>& more) {
      TrainOptions o =
          test::small_run(folder_ / (name + modality), "cpu",
                          {"train.updates=1", "train.num_steps=60", "train.adv_filter_threshold=0",
                           "train.update_epochs=1", "train.minibatch_size=64", "simulator.num_slots=48",
                           "simulator.reset_inactive_fraction=2", std::string("policy.modality=") + modality});
      o.overrides.insert(o.overrides.end(), more.begin(), more.end());
      UpdateCost cost;
      o.on_progress = [&cost](const TrainProgress& progress) { cost = progress.cost; };
      train(o);
      return cost;
    };
    const UpdateCost plain = learn("plain", {}), among = learn("among", {others({vectors + "=0.3", images + "=0.2"})});
    EXPECT_EQ(among.slot_steps, plain.slot_steps);
    EXPECT_NEAR(static_cast<double>(among.agent_steps) / static_cast<double>(plain.agent_steps), 0.5, 0.2);
    EXPECT_EQ(among.kept_fraction, 1);
    EXPECT_EQ(among.minibatches, (among.agent_steps + 63) / 64);
  }
}

TEST_F(OpponentsTest, RunsResumeExactly) {
  const std::string held = policy_of("held", {"policy.modality=vector", "policy.decision_steps=3"});
  const auto [whole, again, resumed] =
      test::policies_of_equal_runs(folder_.path(), "cpu", {others({held + "=0.5"}), "simulator.others.blind=0.1"});
  EXPECT_EQ(again, whole);
  EXPECT_EQ(resumed, whole);
  EXPECT_NE(train(test::small_run(folder_ / "alone", "cpu", {"train.updates=2"})).policy_hash, whole);
}

TEST_F(OpponentsTest, ErrorsNameInvalidOpponents) {
  const auto message = [&](const std::vector<std::string>& texts, std::vector<std::string> settings = {}) {
    settings.push_back(others(texts));
    return test::message_of([&] { train(test::small_run(folder_ / "run", "cpu", settings)); });
  };
  const std::string vectors = policy_of("vectors", {"policy.modality=vector", "policy.auxiliary=true"}),
                    held = policy_of("held", {"policy.decision_steps=4"});
  EXPECT_THAT(message({vectors + "=0.1"}, {"policy.modality=vector"}),
              HasSubstr(vectors + ": simulator.others.policies: its policy.auxiliary is true, expected false"));
  EXPECT_THAT(message({held + "=0.1"}, {"train.num_steps=6"}),
              HasSubstr("its policy.decision_steps is 4, expected a divisor of train.num_steps (6)"));
  EXPECT_THAT(message({folder_ / "absent.safetensors=0.1"}), HasSubstr("absent.safetensors"));
  EXPECT_THAT(message({"half"}), HasSubstr("simulator.others.policies: expected a policy's file and its share above 0, "
                                           "for instance models/vector.safetensors=0.1, got 'half'"));
  EXPECT_THAT(message({"a=0.5", "b=0.5"}), HasSubstr("expected shares that sum to less than 1"));
  EXPECT_THAT(message(std::vector<std::string>(9, "a=0.1")), HasSubstr("expected at most 8 policies, got 9"));
}

}  // namespace
}  // namespace pictura
