// Checks of reproducible training runs that average their weights.
#pragma once

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <gtest/gtest.h>

#include "pictura/tests/training/small_runs.h"
#include "pictura/training/checkpoint.h"

namespace pictura::test {

inline bool are_equal(const std::vector<NamedTensor>& a, const std::vector<NamedTensor>& b) {
  return std::equal(a.begin(), a.end(), b.begin(), b.end(), [](const NamedTensor& x, const NamedTensor& y) {
    return x.name == y.name && x.value.equal(y.value);
  });
}

/// Makes two runs of four updates: folder/with, which averages the weights, and folder/without. Checks the average
/// after each update, and that both learn the same policy. Returns their reports.
inline std::array<TrainReport, 2> check_average_by_hand(const std::string& folder, const std::string& device) {
  const std::vector<std::string> reproducible{"train.reproducible=true", "train.checkpoint_every=1",
                                              "train.keep_checkpoints=9"};
  std::vector<std::string> averaging = reproducible;
  averaging.emplace_back("train.weight_average=1.5");
  const TrainReport without = train(small_run(folder + "/without", device, reproducible)),
                    with = train(small_run(folder + "/with", device, averaging));
  EXPECT_EQ(with.policy_hash, without.policy_hash);

  const Checkpoint last = read_checkpoint(with.checkpoint);
  EXPECT_EQ(last.averaged_updates, 4);
  std::vector<at::Tensor> expected;
  const double least_weight = 1 - std::exp2(-1 / 1.5);
  for (int n = 1; n <= 4; ++n) {
    const Checkpoint saved = n == 4 ? last : read_checkpoint(fmt::format("{}/with/checkpoint.{}.ckpt", folder, 4 - n));
    EXPECT_EQ(saved.update, n);
    for (size_t i = 0; i < saved.parameters.size(); ++i) {
      const at::Tensor value = saved.parameters[i].value.to(at::kDouble);
      if (n == 1)
        expected.push_back(value);
      else
        expected[i] = expected[i] + std::max(1.0 / n, least_weight) * (value - expected[i]);
    }
  }
  EXPECT_EQ(last.average.size(), expected.size());
  for (size_t i = 0; i < std::min(expected.size(), last.average.size()); ++i) {
    EXPECT_TRUE(at::allclose(last.average[i].value.to(at::kDouble), expected[i], 1e-5, 1e-7)) << last.average[i].name;
  }
  EXPECT_FALSE(are_equal(last.average, last.parameters));
  EXPECT_TRUE(are_equal(read_policy(folder + "/with/policy_average.safetensors").parameters, last.average));
  EXPECT_TRUE(are_equal(read_policy(folder + "/with/policy.safetensors").parameters, last.parameters));
  return {without, with};
}

/// Checks that a resumed run has the average of an uninterrupted run.
inline void check_average_resumes_exactly(const std::string& folder, const std::string& device) {
  const auto run = [&](const std::string& name, int updates, OldRun old_run) {
    TrainOptions o =
        small_run(folder + "/" + name, device,
                  {"train.reproducible=true", "train.weight_average=1", fmt::format("train.updates={}", updates)});
    o.old_run = old_run;
    return read_checkpoint(train(o).checkpoint);
  };
  const Checkpoint whole = run("whole", 4, OldRun::refuse);
  run("parts", 2, OldRun::refuse);
  const Checkpoint parts = run("parts", 4, OldRun::resume);
  EXPECT_EQ(parts.averaged_updates, 4);
  EXPECT_TRUE(are_equal(parts.average, whole.average));
  EXPECT_TRUE(are_equal(parts.parameters, whole.parameters));
}

}  // namespace pictura::test
