// Ranks, the processes of a distributed run: their launch, connection and loss, their collective operations, and that
// they learn the policy that a single rank learns. In these tests, ranks are threads; in
// tests/apps/ranks_command_test.py, they are processes.
#include "pictura/training/ranks/ranks.h"

#include <cstdlib>
#include <functional>
#include <map>

#include <ATen/Parallel.h>
#include <gmock/gmock.h>
#include <netinet/in.h>
#include <sys/socket.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/training/corridor.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/run.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

// A socket that listens at a free port of this host.
struct Listener {
  int fd = socket(AF_INET, SOCK_STREAM, 0);
  int port = 0;

  Listener() {
    sockaddr_in address{};
    address.sin_family = AF_INET;
    address.sin_addr.s_addr = htonl(INADDR_ANY);
    auto* const any = reinterpret_cast<sockaddr*>(&address);
    socklen_t size = sizeof address;
    EXPECT_EQ(bind(fd, any, size), 0);
    EXPECT_EQ(listen(fd, 1), 0);
    EXPECT_EQ(getsockname(fd, any, &size), 0);
    port = ntohs(address.sin_port);
  }
  ~Listener() { close(fd); }
};

int free_port() { return Listener().port; }

Launch place(int rank, int size, int port) {
  Launch launch;
  launch.rank = rank, launch.size = size, launch.port = port;
  return launch;
}

// Runs f(its ranks) in a thread each, and returns the error of each.
std::vector<std::string> run_ranks(int size, const std::function<void(Ranks&)>& f, const RankTimeouts& timeouts = {}) {
  const int port = free_port();
  std::vector<std::string> errors(static_cast<size_t>(size));
  std::vector<std::thread> threads;
  for (int rank = 0; rank < size; ++rank) {
    threads.emplace_back([&, rank] {
      errors[rank] = message_of([&] {
        Ranks ranks(place(rank, size, port), timeouts);
        f(ranks);
      });
    });
  }
  for (std::thread& thread : threads) thread.join();
  return errors;
}

class LaunchVariables : public ::testing::Test {
 protected:
  // Launch from these variables; all others are unset.
  static Launch launch(const std::map<std::string, std::string>& variables) {
    for (const char* name :
         {"RANK", "WORLD_SIZE", "LOCAL_RANK", "MASTER_ADDR", "MASTER_PORT", "SLURM_PROCID", "SLURM_STEP_NUM_TASKS",
          "SLURM_LOCALID", "SLURM_STEP_NODELIST", "TORCHELASTIC_USE_AGENT_STORE", "TORCHELASTIC_RESTART_COUNT"}) {
      const auto found = variables.find(name);
      found == variables.end() ? unsetenv(name) : setenv(name, found->second.c_str(), 1);
    }
    return launch_from_environment();
  }
  void TearDown() override { launch({}); }
};

TEST_F(LaunchVariables, DefaultToOneProcess) {
  EXPECT_EQ(launch({}).size, 1);
  // A batch script of several tasks is one process; srun starts the others.
  EXPECT_EQ(launch({{"SLURM_PROCID", "0"}, {"SLURM_LOCALID", "0"}}).size, 1);
}

TEST_F(LaunchVariables, SupportTorchrunAndPlainVariables) {
  const Launch plain = launch({{"RANK", "3"}, {"WORLD_SIZE", "8"}});
  EXPECT_EQ(plain.rank, 3);
  EXPECT_EQ(plain.size, 8);
  EXPECT_EQ(plain.local_rank, 3);
  EXPECT_EQ(plain.address, "127.0.0.1");
  EXPECT_EQ(plain.port, 29500);
  EXPECT_FALSE(plain.is_served);
  const Launch torchrun = launch({{"RANK", "9"},
                                  {"WORLD_SIZE", "16"},
                                  {"LOCAL_RANK", "1"},
                                  {"MASTER_ADDR", "head"},
                                  {"MASTER_PORT", "1234"},
                                  {"TORCHELASTIC_USE_AGENT_STORE", "True"},
                                  {"TORCHELASTIC_RESTART_COUNT", "2"}});
  EXPECT_EQ(torchrun.local_rank, 1);
  EXPECT_EQ(torchrun.address, "head");
  EXPECT_EQ(torchrun.port, 1234);
  EXPECT_TRUE(torchrun.is_served);
  EXPECT_EQ(torchrun.attempt, "2");
}

TEST_F(LaunchVariables, SupportSlurm) {
  const Launch slurm = launch({{"SLURM_PROCID", "5"},
                               {"SLURM_STEP_NUM_TASKS", "8"},
                               {"SLURM_LOCALID", "1"},
                               {"SLURM_STEP_NODELIST", "gpu[07-08,11],other"}});
  EXPECT_EQ(slurm.rank, 5);
  EXPECT_EQ(slurm.size, 8);
  EXPECT_EQ(slurm.local_rank, 1);
  EXPECT_EQ(slurm.address, "gpu07");
  EXPECT_EQ(first_slurm_host("one,two"), "one");
  EXPECT_EQ(first_slurm_host("one"), "one");
  EXPECT_EQ(first_slurm_host("one,two[1-2]"), "one");
}

TEST_F(LaunchVariables, ErrorsNameInvalidVariables) {
  const auto refusal = [](const std::map<std::string, std::string>& variables) {
    return message_of([&] { launch(variables); });
  };
  EXPECT_THAT(refusal({{"RANK", "1"}}), HasSubstr("WORLD_SIZE"));
  EXPECT_THAT(refusal({{"WORLD_SIZE", "2"}}), HasSubstr("RANK"));
  EXPECT_THAT(refusal({{"RANK", "2"}, {"WORLD_SIZE", "2"}}), AllOf(HasSubstr("RANK"), HasSubstr("[0, 1]")));
  EXPECT_THAT(refusal({{"RANK", "0"}, {"WORLD_SIZE", "two"}}), AllOf(HasSubstr("WORLD_SIZE"), HasSubstr("'two'")));
  EXPECT_THAT(refusal({{"MASTER_PORT", "70000"}}), HasSubstr("MASTER_PORT"));
}

TEST(RankRendezvous, ReportsMissingRanks) {
  const int port = free_port();
  EXPECT_THAT(message_of([&] { Ranks ranks(place(0, 3, port), {.join_s = 0.2}); }),
              AllOf(HasSubstr("2 of 3 ranks did not reach"), HasSubstr(std::to_string(port)), HasSubstr("1, 2")));
}

TEST(RankRendezvous, RefusesAPortInUse) {
  const Listener other;
  EXPECT_THAT(
      message_of([&] { Ranks ranks(place(0, 2, other.port), {.join_s = 1}); }),
      AllOf(HasSubstr("rank 0"), HasSubstr("MASTER_PORT"), HasSubstr(std::to_string(other.port)), HasSubstr("in use")));
}

TEST(RankRendezvous, RefusesDuplicateRanks) {
  const std::vector<std::string> errors = run_ranks(2, [](Ranks& ranks) {
    if (ranks.rank() == 0) {
      EXPECT_THAT(message_of([&] { Ranks again(place(1, 2, ranks.launch().port), {.join_s = 1}); }),
                  HasSubstr("another process"));
    }
  });
  EXPECT_THAT(errors, ::testing::Each(test::kNoError));
}

TEST(RankFailures, ErrorsGiveTheReasonOfTheFailedRank) {
  const std::vector<std::string> errors = run_ranks(3, [](Ranks& ranks) {
    if (ranks.rank() == 2) {
      ranks.announce("no space left");
      fail("no space left");
    }
    while (true) {
      ranks.step();
      std::this_thread::sleep_for(std::chrono::milliseconds(5));
    }
  });
  EXPECT_EQ(errors[2], "no space left");
  for (size_t rank : {0, 1}) EXPECT_EQ(errors[rank], "rank 2 ended: no space left");
}

TEST(RankFailures, HangsAreDetectedButLongWorkIsAllowed) {
  const std::vector<std::string> errors = run_ranks(2,
                                                    [](Ranks& ranks) {
                                                      ranks.step();
                                                      if (ranks.rank() == 1) {
                                                        {
                                                          const Ranks::LongWork work(&ranks);
                                                          std::this_thread::sleep_for(std::chrono::seconds(3));
                                                        }
                                                        ranks.check();
                                                        std::this_thread::sleep_for(std::chrono::seconds(5));
                                                        ranks.check();
                                                      } else {
                                                        ranks.step();
                                                        ranks.throw_if_lost();
                                                      }
                                                    },
                                                    {.silent_s = 10, .no_progress_s = 1.5});
  EXPECT_THAT(errors[0], AllOf(HasSubstr("rank 1: alive"), HasSubstr("hangs")));
  EXPECT_THAT(errors[1], HasSubstr("rank 1: alive"));
}

TEST(RankFailures, SlowStepsWithinTheLimitAreAllowed) {
  const std::vector<std::string> errors = run_ranks(2,
                                                    [](Ranks& ranks) {
                                                      ranks.set_no_progress_s(60);
                                                      ranks.step();
                                                      if (ranks.rank() == 0) ranks.step();
                                                      std::this_thread::sleep_for(std::chrono::seconds(3));
                                                      ranks.step();
                                                    },
                                                    {.silent_s = 10, .no_progress_s = 0.5});
  EXPECT_THAT(errors, ::testing::Each(test::kNoError));
}

TEST(Communicators, GiveEveryRankTheSameBits) {
  std::vector<at::Tensor> sums(3);
  const std::vector<std::string> errors = run_ranks(3, [&](Ranks& ranks) {
    const std::unique_ptr<Communicator> communicator = make_communicator(&ranks, Device{});
    EXPECT_EQ(communicator->name(), "gloo");
    EXPECT_EQ(communicator->size(), 3);
    const int rank = communicator->rank();
    const at::Tensor sum = (at::arange(1001, at::kFloat) * (0.1 + rank)).sin();
    communicator->sum(sum);
    sums[rank] = sum;
    EXPECT_EQ(communicator->max_of(rank == 1 ? 7 : -rank), 7);
    const at::Tensor copied = at::full({4}, rank, at::kByte);
    communicator->broadcast(copied, 2);
    EXPECT_TRUE(copied.equal(at::full({4}, 2, at::kByte)));
    const std::vector<uint8_t> own(static_cast<size_t>(rank), uint8_t(rank));  // rank 0 has none
    EXPECT_EQ(communicator->gather(own), (std::vector<std::vector<uint8_t>>{{}, {1}, {2, 2}}));
    EXPECT_EQ(communicator->from_first(rank == 0 ? "said" : ""), "said");
    SimulatorTotals totals;
    totals.agent_steps = 10 + rank;
    totals.finished_first_motion_s = 0.5;
    totals = totals_of_all(totals, communicator.get());
    EXPECT_EQ(totals.agent_steps, 33);
    EXPECT_EQ(totals.finished_first_motion_s, 1.5);
    EXPECT_EQ(totals.episodes, 0);
  });
  EXPECT_THAT(errors, ::testing::Each(test::kNoError));
  const at::Tensor expected = (at::arange(1001, at::kFloat) * 0.1).sin() + (at::arange(1001, at::kFloat) * 1.1).sin() +
                              (at::arange(1001, at::kFloat) * 2.1).sin();
  EXPECT_TRUE(sums[0].allclose(expected, 1e-5, 1e-6));
  EXPECT_TRUE(sums[1].equal(sums[0]));
  EXPECT_TRUE(sums[2].equal(sums[0]));
}

PolicySection tiny_policy() {
  PolicySection policy;
  policy.modality = Modality::vector;
  policy.embedding_width = 8;
  policy.backbone_layers = 1;
  policy.backbone_width = 16;
  return policy;
}

// Returns the slots [begin, end) of a rollout.
Rollout part_of(const Rollout& whole, int64_t begin, int64_t end) {
  const auto part = [&](const at::Tensor& t) { return t.narrow(1, begin, end - begin).contiguous(); };
  Rollout result(RolloutObservations(whole.observations.arrays().map(part)), whole.num_steps(), end - begin, Device{});
  for (at::Tensor Rollout::* t : {&Rollout::values, &Rollout::actions, &Rollout::log_probs, &Rollout::rewards,
                                  &Rollout::terminated, &Rollout::truncated, &Rollout::valid}) {
    result.*t = part(whole.*t);
  }
  if (whole.teacher_scene.defined()) result.teacher_scene = part(whole.teacher_scene);
  return result;
}

struct Learnt {
  std::vector<std::string> hashes;  // after each update
  std::vector<at::Tensor> steps;    // step of each parameter in the first update
  UpdateStats first, last;
};

// Runs three updates on the corridor by ranks that own its slots up to each of these ends; each rank simulates all
// slots.
std::vector<Learnt> learn(const std::vector<int64_t>& ends, const TrainSection& train) {
  std::vector<Learnt> of_ranks(ends.size());
  const std::vector<std::string> errors = run_ranks(static_cast<int>(ends.size()), [&](Ranks& ranks) {
    at::set_num_threads(1);
    const std::unique_ptr<Communicator> communicator = make_communicator(&ranks, Device{});
    const auto rank = static_cast<size_t>(ranks.rank());
    Learnt& learnt = of_ranks[rank];
    const PolicyNetwork policy(tiny_policy(), 4, 3);
    std::vector<at::Tensor> before;
    for (const NamedTensor& parameter : policy.parameters()) before.push_back(parameter.value.detach().clone());
    test::Corridor corridor;
    Optimizer optimizer(policy, train);
    AdvantageFilter filter;
    WeightAverage average(policy, 2);
    for (int64_t update = 0; update < 3; ++update) {
      corridor.play(policy, update);
      // The last slots have no valid transitions in the second update: the last rank has nothing to learn from.
      if (update == 1) corridor.rollout.valid.narrow(1, 100, test::Corridor::kSlots - 100).fill_(0);
      if (train.teacher_scene_coef > 0) {
        const std::vector<int64_t> shape{test::Corridor::kSteps, test::Corridor::kSlots, policy.scene_width()};
        corridor.rollout.teacher_scene = at::arange(c10::multiply_integers(shape), at::kFloat).sin().view(shape);
      }
      Rollout own = part_of(corridor.rollout, rank == 0 ? 0 : ends[rank - 1], ends[rank]);
      ChunkRunner runner(policy, own.observations);
      learnt.last = ppo_update({&runner, corridor.executor.get(), &optimizer, &filter, nullptr, communicator.get()},
                               &own, train, {9, update, train.learning_rate});
      average.update();
      learnt.hashes.push_back(policy.hash() + hash_of_parameters(average.values));
      if (update > 0) continue;
      learnt.first = learnt.last;
      for (size_t i = 0; i < before.size(); ++i) {
        learnt.steps.push_back(policy.parameters()[i].value.detach() - before[i]);
      }
    }
  });
  EXPECT_THAT(errors, ::testing::Each(test::kNoError));
  return of_ranks;
}

// Settings with which parameters step along the unscaled gradient.
TrainSection plain_steps() {
  TrainSection train;
  train.gamma = 0.9;
  train.gae_lambda = 0.9;
  train.schedule = Schedule::constant;
  train.learning_rate = 0.01;
  train.adam_eps = 1;
  train.weight_decay = 0;
  train.max_grad_norm = 1e6;
  train.update_epochs = 2;
  train.minibatch_size = 60;
  train.forward_chunk = 32;
  train.adv_filter_threshold = 0.02;
  return train;
}

TEST(RankTraining, GivesBitwiseIdenticalPoliciesWithMuon) {
  TrainSection train = plain_steps();
  train.optimizer = OptimizerKind::muon;
  const std::vector<Learnt> ranks = learn({10, 100, test::Corridor::kSlots}, train);
  for (const Learnt& rank : ranks) EXPECT_EQ(rank.hashes, ranks[0].hashes);
  EXPECT_NE(ranks[0].hashes[0], ranks[0].hashes[2]);
}

TEST(RankTraining, FiltersByAQuantileOverAllRanks) {
  TrainSection train = plain_steps();
  train.adv_filter = FilterThreshold::quantile;
  const Learnt one = learn({test::Corridor::kSlots}, train).front();
  for (const std::vector<int64_t>& ends : {std::vector<int64_t>{48, 128}, std::vector<int64_t>{10, 100, 128}}) {
    const std::vector<Learnt> ranks = learn(ends, train);
    for (const Learnt& rank : ranks) {
      EXPECT_EQ(rank.hashes, ranks[0].hashes);
      EXPECT_EQ(rank.first.adv_threshold, one.first.adv_threshold) << "of the same bits by counts alone";
      EXPECT_EQ(rank.first.kept_fraction, one.first.kept_fraction);
    }
  }
  EXPECT_NEAR(one.first.kept_fraction, 0.5, 0.01);
}

TEST(RankTraining, MatchesOneRankAndIsBitwiseIdenticalAmongRanks) {
  const TrainSection train = plain_steps();
  const Learnt one = learn({test::Corridor::kSlots}, train).front();
  ASSERT_GT(one.last.minibatches, 6);
  ASSERT_LT(one.last.kept_fraction, 0.95);
  for (const std::vector<int64_t>& ends : {std::vector<int64_t>{48, 128}, std::vector<int64_t>{10, 100, 128}}) {
    const std::vector<Learnt> ranks = learn(ends, train);
    for (const Learnt& rank : ranks) {
      ASSERT_EQ(rank.hashes.size(), 3u);
      EXPECT_EQ(rank.hashes, ranks[0].hashes);
      EXPECT_EQ(rank.last.minibatches, one.last.minibatches);
      EXPECT_NEAR(rank.last.kept_fraction, one.last.kept_fraction, 0.01);
      EXPECT_EQ(rank.last.all.value_loss, ranks[0].last.all.value_loss);
    }
    EXPECT_NEAR(ranks[0].last.all.value_loss, one.last.all.value_loss, 1e-4 * one.last.all.value_loss);
    EXPECT_NEAR(ranks[0].last.explained_variance, one.last.explained_variance, 1e-3);
    EXPECT_NEAR(ranks[0].last.all.grad_norm, one.last.all.grad_norm, 1e-3 * one.last.all.grad_norm);
    // Sum of the gradients of all minibatches of the first update: fp32 sums in another order.
    for (size_t i = 0; i < one.steps.size(); ++i) {
      const double largest = one.steps[i].abs().max().item<double>();
      EXPECT_LE((ranks[0].steps[i] - one.steps[i]).abs().max().item<double>(), 1e-4 * largest + 1e-9) << i;
    }
  }
}

TEST(RankTraining, ScalesTheSceneLossOverAllRanks) {
  TrainSection train = plain_steps();
  train.teacher_scene_coef = 1;
  const Learnt one = learn({test::Corridor::kSlots}, train).front();
  EXPECT_GT(one.last.all.scene, 0);
  const std::vector<Learnt> ranks = learn({10, 100, test::Corridor::kSlots}, train);
  for (const Learnt& rank : ranks) {
    EXPECT_EQ(rank.hashes, ranks[0].hashes);
    EXPECT_NEAR(rank.first.all.scene, one.first.all.scene, 1e-5 * one.first.all.scene);
  }
}

TEST(RankTraining, MatchesOneRankWithHaltedSlotsDrawn) {
  TrainSection train = plain_steps();
  train.adv_filter_threshold = 0;
  train.halted_slots = HaltedSlots::draw;
  const Learnt one = learn({test::Corridor::kSlots}, train).front();
  const std::vector<Learnt> ranks = learn({48, 128}, train);
  EXPECT_EQ(ranks[0].hashes, ranks[1].hashes);
  for (size_t i = 0; i < one.steps.size(); ++i) {
    const double largest = one.steps[i].abs().max().item<double>();
    EXPECT_LE((ranks[0].steps[i] - one.steps[i]).abs().max().item<double>(), 1e-4 * largest + 1e-9) << i;
  }
}

TEST(RankTraining, DetectsDifferingPolicies) {
  const Config config =
      load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml",
                  {"run.device=cpu", "run.num_threads=1", "policy.modality=vector", "train.num_steps=2",
                   "simulator.num_slots=6", "simulator.min_agents=3", "simulator.max_agents=3"});
  const std::vector<std::string> errors = run_ranks(2, [&](Ranks& ranks) {
    const std::unique_ptr<Communicator> communicator = make_communicator(&ranks, Device{});
    const pictura::Run run(config, Device{}, communicator.get());
    EXPECT_EQ(run.simulator->num_slots(), 3);
    run.check_ranks_agree();
    const NamedTensor& parameter = run.policy->parameters()[5];
    if (ranks.rank() == 1) parameter.value.detach().view(at::kInt).flatten().narrow(0, 0, 1).bitwise_xor_(1);
    EXPECT_THAT(message_of([&] { run.check_ranks_agree(); }), HasSubstr("'" + parameter.name + "'"));
  });
  EXPECT_THAT(errors, ::testing::Each(test::kNoError));
}

TEST(RankTraining, StopsAllRanksOnNaN) {
  const std::vector<std::string> errors = run_ranks(2, [&](Ranks& ranks) {
    const std::unique_ptr<Communicator> communicator = make_communicator(&ranks, Device{});
    const TrainSection train = plain_steps();
    const PolicyNetwork policy(tiny_policy(), 4, 3);
    const std::string before = policy.hash();
    test::Corridor corridor;
    Optimizer optimizer(policy, train);
    AdvantageFilter filter;
    corridor.play(policy, 0);
    Rollout own = part_of(corridor.rollout, 64 * ranks.rank(), 64 * ranks.rank() + 64);
    if (ranks.rank() == 1) own.log_probs.fill_(std::numeric_limits<float>::quiet_NaN());
    ChunkRunner runner(policy, own.observations);
    const Learner learner{&runner, corridor.executor.get(), &optimizer, &filter, nullptr, communicator.get()};
    EXPECT_THROW(ppo_update(learner, &own, train, {9, 0, 0.01}), NotFinite);
    EXPECT_EQ(policy.hash(), before);
  });
  EXPECT_THAT(errors, ::testing::Each(test::kNoError));
}

}  // namespace
}  // namespace pictura
