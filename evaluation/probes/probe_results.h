// What the results of all probes have in common: who was asked in which worlds, what they answered, and means over
// scenes. Without torch headers.
#pragma once

#include <algorithm>
#include <map>
#include <string>
#include <vector>

#include "pictura/evaluation/results.h"

namespace pictura {

/// What a policy makes of a state with a road user, V(o) and P(brake | o), and of that without it, o'.
struct PairedResponse {
  float value = 0, value_without = 0;
  float brake = 0, brake_without = 0;

  double value_change() const { return double{value} - double{value_without}; }
  double brake_change() const { return double{brake} - double{brake_without}; }
  bool is_unchanged() const { return value == value_without && brake == brake_without; }
};

struct ProbedPolicy {
  std::string name;  // of its file or run; unique
  std::string path, hash;
  bool reads_images = false;
  std::string untrained_hash;  // of who answered in its place, with fresh weights; empty: it answered itself

  /// What figures and tables call who answered.
  std::string answers_as() const { return untrained_hash.empty() ? name : "untrained " + name; }
};

struct ProbeResults {
  EvaluationSetting setting;  // of the worlds; what of it is a policy's is the first one's
  std::string density;
  int agents_per_world = 0;
  int first_scene = 0, scenes = 0;  // which were driven: an equal share by each policy, in their order
  int sample_steps = 0;
  std::vector<ProbedPolicy> policies;
  std::string controller;                 // that drove all scenes; empty: the policies did
  std::vector<PairedResponse> responses;  // [cases, policies]
  bool interrupted = false;
  double seconds = 0;

  /// By its index: a controller comes after all policies.
  const std::string& driver_name(int32_t driver) const {
    const auto index = static_cast<size_t>(driver);
    return index < policies.size() ? policies[index].name : controller;
  }
  const PairedResponse& response(size_t one, size_t policy) const { return responses[one * policies.size() + policy]; }
};

/// Responses of one policy to cases of one kind. Estimates are over scenes: the mean over scenes of the means of their
/// cases, with its 95 % interval; infinite where there are none.
struct ResponseMeans {
  int64_t cases = 0;
  int scenes = 0;  // that have such cases
  Estimate abs_value_change, abs_brake_change;
  Estimate value_change, brake_change;  // signed
  Estimate changed_share;               // of the cases: in which value or probability are not the same bits
};

/// The mean over scenes of the means of what was added for them.
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

/// Collects responses.
class ResponseSums {
 public:
  void add(int32_t scene, const PairedResponse& response);
  ResponseMeans means() const;

 private:
  SceneMeans abs_value_change_, abs_brake_change_, value_change_, brake_change_, changed_;
};

/// The order of some items by their keys.
template <typename Key>
std::vector<size_t> sorted_order(size_t count, const Key& key) {
  std::vector<size_t> order(count);
  for (size_t i = 0; i < count; ++i) order[i] = i;
  std::sort(order.begin(), order.end(), [&key](size_t a, size_t b) { return key(a) < key(b); });
  return order;
}

/// Of a CSV file with a row a case: the header's fields, and a case's, of each policy: value, d_value, p_brake and
/// d_p_brake. Both begin with a comma.
std::string response_header(const ProbeResults& results);
std::string response_fields(const ProbeResults& results, size_t one);

}  // namespace pictura
