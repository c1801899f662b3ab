// Results that all probes have in common: policies and worlds, responses, and means over scenes. Includes no torch
// headers.
#pragma once

#include <algorithm>
#include <cmath>
#include <map>
#include <string>
#include <vector>

#include "pictura/evaluation/results.h"

namespace pictura {

/// Responses of a policy to a state with a road user, and to the same state without the user. A response consists of
/// the value and the probability of braking. The value is NaN if the policy has none.
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
  std::string name;  // unique; from the name of the policy's file or run
  std::string path, hash;
  bool reads_images = false;
  std::string untrained_hash;  // hash of the fresh weights that respond instead of the policy; empty: the policy itself
                               // responds

  /// Name of the responding policy in figures and tables.
  std::string responding_name() const { return untrained_hash.empty() ? name : "untrained " + name; }
};

struct ProbeResults {
  EvaluationSetting setting;  // setting of the worlds; parts that depend on the policy are those of the first policy
  std::string density;
  int agents_per_world = 0;
  int first_scene = 0, scenes = 0;  // driven scenes: each policy drives an equal share, in the order of policies
  int sample_steps = 0;
  std::vector<ProbedPolicy> policies;
  std::string controller;                 // controller that drove all scenes; empty: the policies drove
  std::vector<PairedResponse> responses;  // [cases, policies]
  bool interrupted = false;
  double seconds = 0;

  /// Name of a driver by its index; a controller comes after all policies.
  const std::string& driver_name(int32_t driver) const {
    const auto index = static_cast<size_t>(driver);
    return index < policies.size() ? policies[index].name : controller;
  }
  const PairedResponse& response(size_t one, size_t policy) const { return responses[one * policies.size() + policy]; }
};

/// Mean responses of one policy to cases of one kind. An estimate is the mean over scenes of each scene's mean over its
/// cases, with a 95 % interval. Without scenes, mean and interval are infinite.
struct ResponseMeans {
  int64_t cases = 0;
  int scenes = 0;  // number of scenes with cases of this kind
  Estimate abs_value_change, abs_brake_change;
  Estimate value_change, brake_change;  // signed
  Estimate changed_share;  // share of cases in which the value or the probability differs in at least one bit
};

/// Mean over scenes of the mean of each scene's values.
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

/// Accumulates responses.
class ResponseSums {
 public:
  void add(int32_t scene, const PairedResponse& response);
  ResponseMeans means() const;

 private:
  SceneMeans abs_value_change_, abs_brake_change_, value_change_, brake_change_, changed_;
};

/// Returns the indices of `count` items in ascending order of key(index).
template <typename Key>
std::vector<size_t> sorted_order(size_t count, const Key& key) {
  std::vector<size_t> order(count);
  for (size_t i = 0; i < count; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&key](size_t a, size_t b) { return key(a) < key(b); });
  return order;
}

/// Return CSV fields of responses: their names for the header, and their values for the row of case `one`. Each policy
/// has the fields value, d_value, p_brake and d_p_brake. Both texts begin with a comma.
std::string response_header(const ProbeResults& results);
std::string response_fields(const ProbeResults& results, size_t one);

}  // namespace pictura
