// Small policies and common tests for probes (experiments on policies' responses).
#pragma once

#include <initializer_list>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/evaluation/probes/probe_options.h"
#include "pictura/evaluation/probes/probe_results.h"
#include "pictura/tests/support/scratch_folder.h"
#include "pictura/tests/training/small_runs.h"

namespace pictura::test {

constexpr size_t kAgent = 0, kVectorized = 1, kLikeForLike = 2;  // indices in policies_

/// One policy that reads images, and two that read vectors, after one update.
class ProbedPolicies : public ::testing::Test {
 protected:
  // The first test trains the policies.
  void SetUp() override {
    if (folder_) return;
    folder_ = new ScratchFolder;
    const auto trained = [](const std::string& name, std::vector<std::string> more) {
      more.insert(more.end(), {"train.updates=1", "simulator.walls=true", "simulator.pedestrian_fraction=0.2"});
      return train(small_run(*folder_ / name, "cpu", more)).checkpoint;
    };
    policies_ = {trained("agent", {}), trained("vectorized", {"policy.modality=vector", "policy.auxiliary=true"}),
                 trained("like_for_like", {"policy.modality=vector"})};
  }
  static void TearDownTestSuite() {
    delete folder_;
    folder_ = nullptr;
  }

  static void ask(ProbeOptions* options) {
    options->policies = policies_;
    options->worlds.maps = {"procedural:1", "procedural:2"};
    options->worlds.agents_per_world = 40;
    options->worlds.first_scenario = 3;
    options->worlds.scenarios = 6;
    options->worlds.steps = 60;
    options->worlds.num_threads = 1;
    options->worlds.device = options->worlds.simulator = "cpu";
    options->sample_steps = 4;  // untrained policies soon halt
  }

  static inline ScratchFolder* folder_ = nullptr;
  static inline std::vector<std::string> policies_;
};

inline bool same_bits(const ProbeResults& a, const ProbeResults& b) {
  if (a.responses.size() != b.responses.size()) return false;
  for (size_t i = 0; i < a.responses.size(); ++i) {
    const PairedResponse &x = a.responses[i], &y = b.responses[i];
    if (x.value != y.value || x.value_without != y.value_without || x.brake != y.brake ||
        x.brake_without != y.brake_without) {
      return false;
    }
  }
  return true;
}

/// Tests of one probe. Kind defines Options, Results, kCases (usual number of cases), set_cases(cases, &options),
/// probe(options), and is_same(results, results).
template <typename Kind>
class ProbeTest : public ProbedPolicies {
 protected:
  using Options = typename Kind::Options;
  using Results = typename Kind::Results;
  using Control = decltype(Options::control);

  static Options options(int64_t cases = Kind::kCases) {
    Options o;
    ask(&o);
    Kind::set_cases(cases, &o);
    return o;
  }
  static Results probe(const Options& o) { return Kind::probe(o); }
  /// Results without a control.
  static const Results& results() {
    static const Results all = probe(options());
    return all;
  }
  static Results controlled(Control control) {
    Options o = options();
    o.control = control;
    return probe(o);
  }

  static void expect_the_same_of_batches(std::initializer_list<int> batches) {
    Options o = options();
    for (const int batch : batches) {
      o.batch = batch;
      EXPECT_TRUE(Kind::is_same(probe(o), results())) << batch;
    }
  }
  /// Checks that seeds change the results of one policy in one scene. Returns the first results.
  static Results expect_seeds_to_decide(int64_t cases) {
    Options o = options(cases);
    o.policies = {policies_[kAgent]};
    o.worlds.scenarios = 1;
    o.worlds.steps = 30;
    Results first = probe(o);
    EXPECT_TRUE(Kind::is_same(first, probe(o)));
    o.worlds.seed = 2;
    EXPECT_FALSE(Kind::is_same(first, probe(o)));
    return first;
  }
};

}  // namespace pictura::test
