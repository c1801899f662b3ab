#include "pictura/training/probes/probe_results.h"

#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "pictura/training/evaluation/csv.h"
#include "pictura/training/probes/probe_json.h"

namespace pictura {

void ResponseSums::add(int32_t scene, const PairedResponse& response) {
  OfScene& sums = scenes_[scene];
  ++sums.cases;
  sums.value_change += response.value_change();
  sums.brake_change += response.brake_change();
  sums.abs_value_change += std::abs(response.value_change());
  sums.abs_brake_change += std::abs(response.brake_change());
  sums.changed += !response.is_unchanged();
}

Estimate ResponseSums::mean_of(double OfScene::* sum) const {
  std::vector<RatioTerm> means;
  for (const auto& [scene, sums] : scenes_) means.push_back({sums.*sum / static_cast<double>(sums.cases), 1});
  return estimate_ratio(means);
}

ResponseMeans ResponseSums::means() const {
  ResponseMeans means{.scenes = static_cast<int>(scenes_.size())};
  for (const auto& [scene, sums] : scenes_) means.cases += sums.cases;
  means.abs_value_change = mean_of(&OfScene::abs_value_change);
  means.abs_brake_change = mean_of(&OfScene::abs_brake_change);
  means.value_change = mean_of(&OfScene::value_change);
  means.brake_change = mean_of(&OfScene::brake_change);
  means.changed_share = mean_of(&OfScene::changed);
  return means;
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

Json policies_json(const ProbeResults& results, const std::vector<int64_t>& cases_driven) {
  Json policies = Json::array();
  for (size_t p = 0; p < results.policies.size(); ++p) {
    const ProbedPolicy& policy = results.policies[p];
    policies.push_back({{"name", policy.name},
                        {"file", policy.path},
                        {"policy_hash", policy.hash},
                        {"reads_images", policy.reads_images},
                        {"scenes_driven", results.scenes / static_cast<int>(results.policies.size())},
                        {"cases_driven", cases_driven[p]}});
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
  json["argmax"] = setting.argmax;
  json["seed"] = setting.seed;
  json["device"] = setting.device;
  json["precision"] = setting.precision;
  for (size_t i = 0; i < kNumConditioning; ++i) json["conditioning"][kConditioningNames[i]] = setting.conditioning[i];
  json["interrupted"] = results.interrupted;
  json["seconds"] = results.seconds;
}

}  // namespace pictura
