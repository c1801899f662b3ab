// Shared results of all probes.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "pictura/evaluation/results.h"

namespace pictura {

/// A policy's value and braking probability in a state with a road user and without it. The value is NaN if the policy
/// has none.
struct PairedResponse {
  float value = 0, value_without = 0;
  float brake = 0, brake_without = 0;

  double value_change() const { return double{value} - double{value_without}; }
  double brake_change() const { return double{brake} - double{brake_without}; }
  bool is_unchanged() const {
    const bool has_no_value = std::isnan(value) && std::isnan(value_without);
    return (has_no_value || value == value_without) && brake == brake_without;
  }
};

struct ProbedPolicy {
  std::string name;  // unique; from its file or run
  std::string path, hash;
  bool reads_images = false;
  std::string untrained_hash;  // hash of fresh weights that respond instead; empty if there are none

  /// Name in figures and tables.
  std::string responding_name() const { return untrained_hash.empty() ? name : "untrained " + name; }
};

struct ProbeResults {
  EvaluationSetting setting;  // policy-dependent parts are the first policy's
  std::string density;
  int agents_per_world = 0;
  int first_scene = 0, scenes = 0;  // each policy drives an equal range, in order
  int sample_steps = 0;
  std::vector<ProbedPolicy> policies;
  std::string controller;                 // controller that drove all scenes; empty: the policies drove
  std::vector<PairedResponse> responses;  // [cases, policies]
  bool interrupted = false;
  double seconds = 0;

  /// A controller's index follows those of all policies.
  const std::string& driver_name(int32_t driver) const {
    const auto index = static_cast<size_t>(driver);
    return index < policies.size() ? policies[index].name : controller;
  }
  const PairedResponse& response(size_t one, size_t policy) const { return responses[one * policies.size() + policy]; }
};

/// Mean responses of one policy. An estimate is the mean of the scenes' means, with a 95 % interval; both are infinite
/// without scenes.
struct ResponseMeans {
  int64_t cases = 0;
  int scenes = 0;  // number of scenes with cases
  Estimate abs_value_change, abs_brake_change;
  Estimate value_change, brake_change;  // signed
  Estimate changed_share;               // cases in which a bit of the value or the probability differs
};

/// Mean over scenes of each scene's mean.
class SceneMeans {
 public:
  void add(int32_t scene, double value) {
    Sum& sum = sums_[scene];
    sum.value += value;
    ++sum.count;
  }
  int64_t count() const;
  int scenes() const { return static_cast<int>(sums_.size()); }
  Estimate mean() const;

 private:
  struct Sum {
    double value = 0;
    int64_t count = 0;
  };
  std::map<int32_t, Sum> sums_;
};

class ResponseSums {
 public:
  void add(int32_t scene, const PairedResponse& response);
  ResponseMeans means() const;

 private:
  SceneMeans abs_value_change_, abs_brake_change_, value_change_, brake_change_, changed_;
};

/// Returns indices in ascending order of key(index).
template <typename Key>
std::vector<size_t> sorted_order(size_t count, const Key& key) {
  std::vector<size_t> order(count);
  for (size_t i = 0; i < count; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&key](size_t a, size_t b) { return key(a) < key(b); });
  return order;
}

/// Return the header and the row of case `one` in CSV: value, d_value, p_brake and d_p_brake of each policy. Both begin
/// with a comma.
std::string response_header(const ProbeResults& results);
std::string response_fields(const ProbeResults& results, size_t one);

}  // namespace pictura
