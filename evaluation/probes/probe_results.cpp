#include "pictura/evaluation/probes/probe_results.h"

#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "pictura/evaluation/csv.h"
#include "pictura/evaluation/probes/probe_json.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

int64_t SceneMeans::count() const {
  int64_t count = 0;
  for (const auto& [scene, sum] : sums_) count += sum.count;
  return count;
}

Estimate SceneMeans::mean() const {
  std::vector<RatioTerm> means;
  for (const auto& [scene, sum] : sums_) means.push_back({sum.value / static_cast<double>(sum.count), 1});
  return estimate_ratio(means);
}

void ResponseSums::add(int32_t scene, const PairedResponse& response) {
  value_change_.add(scene, response.value_change());
  brake_change_.add(scene, response.brake_change());
  abs_value_change_.add(scene, std::abs(response.value_change()));
  abs_brake_change_.add(scene, std::abs(response.brake_change()));
  changed_.add(scene, response.is_unchanged() ? 0 : 1);
}

ResponseMeans ResponseSums::means() const {
  return {.cases = changed_.count(),
          .scenes = changed_.scenes(),
          .abs_value_change = abs_value_change_.mean(),
          .abs_brake_change = abs_brake_change_.mean(),
          .value_change = value_change_.mean(),
          .brake_change = brake_change_.mean(),
          .changed_share = changed_.mean()};
}

std::string response_header(const ProbeResults& results) {
  std::string text;
  for (const ProbedPolicy& policy : results.policies) {
    for (const char* what : {"value", "d_value", "p_brake", "d_p_brake"}) {
      text += ',' + csv_quoted(fmt::format("{}/{}", policy.name, what));
    }
  }
  return text;
}

std::string response_fields(const ProbeResults& results, size_t one) {
  std::string text;
  for (size_t policy = 0; policy < results.policies.size(); ++policy) {
    const PairedResponse& response = results.response(one, policy);
    fmt::format_to(std::back_inserter(text), ",{},{:.9g},{},{:.9g}", response.value, response.value_change(),
                   response.brake, response.brake_change());
  }
  return text;
}

void add_means(const ResponseMeans& means, Json* json_out) {
  Json& json = *json_out;
  json["cases"] = means.cases;
  json["scenes"] = means.scenes;
  add_estimate("abs_d_value", means.abs_value_change, &json);
  add_estimate("abs_d_p_brake", means.abs_brake_change, &json);
  add_estimate("d_value", means.value_change, &json);
  add_estimate("d_p_brake", means.brake_change, &json);
  add_estimate("changed_share", means.changed_share, &json);
}

Json policies_json(const ProbeResults& results, const std::vector<int32_t>& drivers) {
  const int share = results.scenes / static_cast<int>(results.policies.size());
  Json policies = Json::array();
  for (size_t p = 0; p < results.policies.size(); ++p) {
    const ProbedPolicy& policy = results.policies[p];
    policies.push_back({{"name", policy.name},
                        {"file", policy.path},
                        {"policy_hash", policy.hash},
                        {"untrained_hash", policy.untrained_hash.empty() ? Json(nullptr) : Json(policy.untrained_hash)},
                        {"reads_images", policy.reads_images},
                        {"scenes_driven", results.controller.empty() ? share : 0},
                        {"cases_driven", std::count(drivers.begin(), drivers.end(), static_cast<int32_t>(p))}});
  }
  return policies;
}

void add_setting(const ProbeResults& results, Json* json_out) {
  Json& json = *json_out;
  const EvaluationSetting& setting = results.setting;
  json["maps"] = setting.maps;
  json["density"] = results.density;
  json["agents_per_world"] = results.agents_per_world;
  json["first_scene"] = results.first_scene;
  json["scenes"] = results.scenes;
  json["steps"] = setting.steps;
  json["sample_steps"] = results.sample_steps;
  json["driver"] = results.controller.empty() ? "policies" : results.controller;
  json["argmax"] = setting.argmax;
  json["seed"] = setting.seed;
  json["light_heads"] = setting.light_heads;
  json["device"] = setting.device;
  json["precision"] = setting.precision;
  for (size_t i = 0; i < kNumConditioning; ++i) json["conditioning"][kConditioningNames[i]] = setting.conditioning[i];
  json["light_cycles"] = name_of(setting.light_cycles);
  json["interrupted"] = results.interrupted;
  json["seconds"] = results.seconds;
}

}  // namespace pictura
