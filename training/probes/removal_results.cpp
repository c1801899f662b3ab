#include "pictura/training/probes/removal_results.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/ranges.h>
#include <nlohmann/json.hpp>

#include "pictura/common/error.h"
#include "pictura/common/support/output_file.h"
#include "pictura/training/evaluation/csv.h"
#include "pictura/training/evaluation/infractions.h"

namespace pictura {

namespace {

using Json = nlohmann::ordered_json;

int occlusion_bin(const RemovalCase& one) {
  if (!one.is_in_frame()) return -1;
  if (one.visible_share == 0) return RemovalGroup::kOcclusionBins;
  const auto bin = static_cast<int>(one.occlusion() * static_cast<float>(RemovalGroup::kOcclusionBins));
  return std::clamp(bin, 0, RemovalGroup::kOcclusionBins - 1);
}

int distance_band(const RemovalCase& one) { return static_cast<int>(one.distance_m / kDistanceBand_m); }

// Sums of the cases of one scene in one group.
struct SceneSums {
  int64_t cases = 0;
  double abs_value_change = 0, abs_brake_change = 0, value_change = 0, brake_change = 0, changed = 0;
};

// A group's cases, of one policy.
struct GroupSums {
  std::map<int32_t, SceneSums> scenes;
  double occlusion = 0;

  void add(const RemovalCase& one, const RemovalResponse& response) {
    SceneSums& sums = scenes[one.scene];
    ++sums.cases;
    sums.value_change += response.value_change();
    sums.brake_change += response.brake_change();
    sums.abs_value_change += std::abs(response.value_change());
    sums.abs_brake_change += std::abs(response.brake_change());
    sums.changed += !response.is_unchanged();
    occlusion += static_cast<double>(one.occlusion());
  }
  Estimate mean_of(double SceneSums::* sum) const {
    std::vector<RatioTerm> means;
    for (const auto& [scene, sums] : scenes) means.push_back({sums.*sum / static_cast<double>(sums.cases), 1});
    return estimate_ratio(means);
  }
  RemovalRow row(int policy, const RemovalGroup& group) const {
    RemovalRow row{.policy = policy, .group = group, .scenes = static_cast<int>(scenes.size())};
    for (const auto& [scene, sums] : scenes) row.cases += sums.cases;
    row.mean_occlusion = occlusion / static_cast<double>(row.cases);
    row.abs_value_change = mean_of(&SceneSums::abs_value_change);
    row.abs_brake_change = mean_of(&SceneSums::abs_brake_change);
    row.value_change = mean_of(&SceneSums::value_change);
    row.brake_change = mean_of(&SceneSums::brake_change);
    row.changed_share = mean_of(&SceneSums::changed);
    return row;
  }
};

Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

Json to_json(const RemovalRow& row, const RemovalResults& results) {
  const RemovalGroup& group = row.group;
  const bool is_in_frame = group.occlusion_bin >= 0, is_hidden = group.occlusion_bin == RemovalGroup::kOcclusionBins;
  const auto bound = [&](int bin) {
    return is_in_frame ? Json(is_hidden ? 1.0 : bin / static_cast<double>(RemovalGroup::kOcclusionBins))
                       : Json(nullptr);
  };
  const auto distance = [&](int band) {
    return group.distance_band ? Json(static_cast<double>(kDistanceBand_m) * band) : Json(nullptr);
  };
  Json json = {{"policy", results.policies[static_cast<size_t>(row.policy)].name},
               {"group", group.occlusion_name()},
               {"in_frame", is_in_frame},
               {"occlusion_from", bound(group.occlusion_bin)},
               {"occlusion_to", bound(group.occlusion_bin + 1)},
               {"occlusion_mean", finite_or_null(row.mean_occlusion)},
               {"distance_from_m", distance(group.distance_band.value_or(0))},
               {"distance_to_m", distance(group.distance_band.value_or(0) + 1)},
               {"cases", row.cases},
               {"scenes", row.scenes}};
  const auto add = [&json](const std::string& name, const Estimate& estimate) {
    json[name] = finite_or_null(estimate.value);
    json[name + "_half_width_95"] = finite_or_null(estimate.half_width_95);
  };
  add("abs_d_value", row.abs_value_change);
  add("abs_d_p_brake", row.abs_brake_change);
  add("d_value", row.value_change);
  add("d_p_brake", row.brake_change);
  add("changed_share", row.changed_share);
  return json;
}

}  // namespace

RemovalControl removal_control_named(const std::string& name) {
  const auto* const found = std::find(kRemovalControlNames.begin(), kRemovalControlNames.end(), name);
  if (found == kRemovalControlNames.end()) {
    fail_usage("control: expected {}, got '{}'", fmt::join(kRemovalControlNames, ", "), name);
  }
  return static_cast<RemovalControl>(found - kRemovalControlNames.begin());
}

std::string RemovalGroup::occlusion_name() const {
  if (occlusion_bin < 0) return "no camera";
  if (occlusion_bin == kOcclusionBins) return "hidden";
  return fmt::format("{}-{} %", 100 * occlusion_bin / kOcclusionBins, 100 * (occlusion_bin + 1) / kOcclusionBins);
}

std::vector<RemovalRow> summarize(const RemovalResults& results) {
  std::vector<RemovalRow> rows;
  const auto num_bands = static_cast<int>(std::ceil(results.range_m / kDistanceBand_m));
  constexpr int kBins = RemovalGroup::kOcclusionBins + 2;  // with those that are hidden, and in no frame
  for (size_t policy = 0; policy < results.policies.size(); ++policy) {
    std::vector<GroupSums> all(kBins), by_band(static_cast<size_t>(kBins * num_bands));
    for (size_t i = 0; i < results.cases.size(); ++i) {
      const RemovalCase& one = results.cases[i];
      const RemovalResponse& response = results.response(i, policy);
      const int bin = occlusion_bin(one) + 1, band = std::min(distance_band(one), num_bands - 1);
      all[static_cast<size_t>(bin)].add(one, response);
      by_band[static_cast<size_t>(band * kBins + bin)].add(one, response);
    }
    for (int band = -1; band < num_bands; ++band) {
      for (int i = 1; i <= kBins; ++i) {
        const int bin = i % kBins;  // those in no frame come last
        const GroupSums& sums =
            band < 0 ? all[static_cast<size_t>(bin)] : by_band[static_cast<size_t>(band * kBins + bin)];
        RemovalGroup group{.occlusion_bin = bin - 1};
        if (band >= 0) group.distance_band = band;
        rows.push_back(sums.row(static_cast<int>(policy), group));
      }
    }
  }
  return rows;
}

void write_removal_cases(const std::string& path, const RemovalResults& results) {
  OutputFile file(path);
  std::string text =
      "case,scene,map,driver,step,ego,user,hidden,class,halted,distance_m,ego_speed_mps,in_frame,occlusion";
  for (const ProbedPolicy& policy : results.policies) {
    for (const char* what : {"value", "d_value", "p_brake", "d_p_brake"}) {
      text += ',' + csv_quoted(fmt::format("{}/{}", policy.name, what));
    }
  }
  text += '\n';
  constexpr size_t kAtOnce = size_t{1} << 20;
  for (size_t i = 0; i < results.cases.size(); ++i) {
    const RemovalCase& one = results.cases[i];
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{:d},{:.3f},{:.3f},{:d},", i, one.scene,
                   csv_quoted(results.setting.maps[static_cast<size_t>(one.map)]),
                   csv_quoted(results.policies[static_cast<size_t>(one.driver)].name), one.step, one.ego, one.user,
                   one.hidden < 0 ? "" : std::to_string(one.hidden), to_string(one.user_class), one.user_halted,
                   one.distance_m, one.ego_speed_mps, one.is_in_frame());
    if (one.is_in_frame()) fmt::format_to(std::back_inserter(text), "{}", one.occlusion());
    for (size_t policy = 0; policy < results.policies.size(); ++policy) {
      const RemovalResponse& response = results.response(i, policy);
      fmt::format_to(std::back_inserter(text), ",{},{:.9g},{},{:.9g}", response.value, response.value_change(),
                     response.brake, response.brake_change());
    }
    text += '\n';
    if (text.size() < kAtOnce) continue;
    file.write(text);
    text.clear();
  }
  file.write(text);
  file.commit();
}

std::string removal_summary_json(const RemovalResults& results, const std::vector<RemovalRow>& rows,
                                 const std::string& cases_file) {
  Json policies = Json::array(), table = Json::array(), conditioning;
  for (size_t p = 0; p < results.policies.size(); ++p) {
    const ProbedPolicy& policy = results.policies[p];
    const auto drives = [p](const RemovalCase& one) { return one.driver == static_cast<int32_t>(p); };
    policies.push_back({{"name", policy.name},
                        {"file", policy.path},
                        {"policy_hash", policy.hash},
                        {"reads_images", policy.reads_images},
                        {"scenes_driven", results.scenes / static_cast<int>(results.policies.size())},
                        {"cases_driven", std::count_if(results.cases.begin(), results.cases.end(), drives)}});
  }
  for (const RemovalRow& row : rows) table.push_back(to_json(row, results));
  for (size_t i = 0; i < kNumConditioning; ++i) conditioning[kConditioningNames[i]] = results.setting.conditioning[i];
  const Json json = {{"kind", "removal"},
                     {"policy", policies},
                     {"control", kRemovalControlNames[static_cast<size_t>(results.control)]},
                     {"cases", results.cases.size()},
                     {"cases_asked", results.removals_asked},
                     {"cases_file", cases_file.empty() ? Json(nullptr) : Json(cases_file)},
                     {"maps", results.setting.maps},
                     {"density", results.density},
                     {"agents_per_world", results.agents_per_world},
                     {"first_scene", results.first_scene},
                     {"scenes", results.scenes},
                     {"steps", results.setting.steps},
                     {"sample_steps", results.sample_steps},
                     {"range_m", results.range_m},
                     {"argmax", results.setting.argmax},
                     {"seed", results.setting.seed},
                     {"device", results.setting.device},
                     {"precision", results.setting.precision},
                     {"conditioning", conditioning},
                     {"interrupted", results.interrupted},
                     {"seconds", results.seconds},
                     {"rows", table}};
  return json.dump(1);
}

}  // namespace pictura
