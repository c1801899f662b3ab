// A hundred updates in each precision: the policy learns, and the precision changes the result less than the seed does.
#include <algorithm>
#include <array>
#include <cmath>

#include <ATen/Parallel.h>
#include <gmock/gmock.h>

#include "pictura/tests/policy/small_policy.h"
#include "pictura/tests/training/corridor.h"

namespace pictura {
namespace {

using test::Corridor;

constexpr int kUpdates = 100, kWindow = 10;
// Mean reward per step over each `kWindow` updates.
using Curve = std::array<double, kUpdates / kWindow>;

Curve learn(Precision precision, uint64_t seed) {
  const PolicyNetwork policy(test::learning_section(), 1, seed, at::kFloat, /*reads_walls=*/false, Device{}, precision);
  TrainSection train;
  train.minibatch_size = 512;
  train.update_epochs = 1;
  train.learning_rate = 3e-3;
  train.schedule = Schedule::constant;
  train.gamma = 0.9;
  Optimizer optimizer(policy, train);
  AdvantageFilter filter;
  Corridor corridor(seed);
  Curve curve{};
  for (int64_t update = 0; update < kUpdates; ++update) {
    curve.at(static_cast<size_t>(update / kWindow)) += corridor.play(policy, update) / kWindow;
    const UpdateStats stats = corridor.update(policy, train, update, &optimizer, &filter);
    EXPECT_LT(stats.first.abs_log_ratio, kMaxAbsLogRatio);
    EXPECT_LT(stats.first.clip_fraction, kMaxClipFraction);
  }
  return curve;
}

constexpr size_t kNumSeeds = 3;
struct Spread {
  double mean = 0, deviation = 0;
};
Spread spread_of(const std::array<Curve, kNumSeeds>& curves, size_t window) {
  Spread spread;
  for (const Curve& curve : curves) spread.mean += curve[window] / kNumSeeds;
  for (const Curve& curve : curves) spread.deviation += std::pow(curve[window] - spread.mean, 2) / (kNumSeeds - 1);
  spread.deviation = std::sqrt(spread.deviation);
  return spread;
}

TEST(Learning, EachPrecisionLearnsWithinTheSpreadOfSeeds) {
  at::set_num_threads(1);
  const std::array precisions{Precision::fp32, Precision::tf32, Precision::bf16};
  std::array<std::array<Curve, kNumSeeds>, precisions.size()> curves;
  for (size_t p = 0; p < precisions.size(); ++p) {
    for (size_t seed = 0; seed < kNumSeeds; ++seed) curves[p][seed] = learn(precisions[p], seed + 1);
  }
  EXPECT_NE(curves[2], curves[0]) << "bf16 is another arithmetic";
  for (const auto& of_precision : curves) {
    SCOPED_TRACE(::testing::PrintToString(of_precision));
    const Spread first = spread_of(of_precision, 0), last = spread_of(of_precision, Curve{}.size() - 1);
    EXPECT_GT(last.mean - first.mean, 3 * std::max(first.deviation, last.deviation));
    EXPECT_GT(last.mean, 0.3) << "of 0.5 at most";
    for (size_t window = 0; window < Curve{}.size(); ++window) {
      const Spread fp32 = spread_of(curves[0], window);
      EXPECT_NEAR(spread_of(of_precision, window).mean, fp32.mean, 2 * fp32.deviation + 0.01) << window;
    }
  }
}

}  // namespace
}  // namespace pictura
