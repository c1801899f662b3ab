#include "pictura/evaluation/probes/removal_results.h"

#include <algorithm>
#include <cmath>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/output_file.h"
#include "pictura/evaluation/csv.h"
#include "pictura/evaluation/infractions.h"
#include "pictura/evaluation/probes/probe_json.h"

namespace pictura {

namespace {

int occlusion_bin(const RemovalCase& one) {
  if (!one.is_in_frame()) return -1;
  if (one.visible_share == 0) return RemovalGroup::kOcclusionBins;
  const auto bin = static_cast<int>(one.occlusion() * static_cast<float>(RemovalGroup::kOcclusionBins));
  return std::clamp(bin, 0, RemovalGroup::kOcclusionBins - 1);
}

int distance_band(const RemovalCase& one) { return static_cast<int>(one.distance_m / kDistanceBand_m); }

// Sums over the cases of a group for one policy.
struct GroupSums {
  ResponseSums responses;
  double occlusion = 0;

  void add(const RemovalCase& one, const PairedResponse& response) {
    responses.add(one.scene, response);
    occlusion += static_cast<double>(one.occlusion());
  }
  RemovalRow row(int policy, const RemovalGroup& group) const {
    RemovalRow row{responses.means(), policy, group, 0};
    row.mean_occlusion = occlusion / static_cast<double>(row.cases);
    return row;
  }
};

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
  Json json = {{"policy", results.policies[row.policy].name},
               {"group", group.occlusion_name()},
               {"in_frame", is_in_frame},
               {"occlusion_from", bound(group.occlusion_bin)},
               {"occlusion_to", bound(group.occlusion_bin + 1)},
               {"occlusion_mean", finite_or_null(row.mean_occlusion)},
               {"distance_from_m", distance(group.distance_band.value_or(0))},
               {"distance_to_m", distance(group.distance_band.value_or(0) + 1)}};
  add_means(row, &json);
  return json;
}

}  // namespace

std::string RemovalGroup::occlusion_name() const {
  if (occlusion_bin < 0) return "no camera";
  if (occlusion_bin == kOcclusionBins) return "hidden";
  return fmt::format("{}-{} %", 100 * occlusion_bin / kOcclusionBins, 100 * (occlusion_bin + 1) / kOcclusionBins);
}

std::vector<RemovalRow> summarize(const RemovalResults& results) {
  std::vector<RemovalRow> rows;
  const auto num_bands = static_cast<int>(std::ceil(results.range_m / kDistanceBand_m));
  constexpr int kBins = RemovalGroup::kOcclusionBins + 2;  // with bins for hidden users and users outside frames
  for (size_t policy = 0; policy < results.policies.size(); ++policy) {
    std::vector<GroupSums> all(kBins), by_band(static_cast<size_t>(kBins * num_bands));
    for (size_t i = 0; i < results.cases.size(); ++i) {
      const RemovalCase& one = results.cases[i];
      const PairedResponse& response = results.response(i, policy);
      const int bin = occlusion_bin(one) + 1, band = std::min(distance_band(one), num_bands - 1);
      all[bin].add(one, response);
      by_band[band * kBins + bin].add(one, response);
    }
    for (int band = -1; band < num_bands; ++band) {
      for (int i = 1; i <= kBins; ++i) {
        const int bin = i % kBins;  // users outside frames come last
        const GroupSums& sums = band < 0 ? all[bin] : by_band[band * kBins + bin];
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
      "case,scene,map,driver,step,ego,user,hidden,class,halted,distance_m,ego_speed_mps,in_frame,occlusion" +
      response_header(results);
  text += '\n';
  constexpr size_t kAtOnce = size_t{1} << 20;
  for (size_t i = 0; i < results.cases.size(); ++i) {
    const RemovalCase& one = results.cases[i];
    fmt::format_to(std::back_inserter(text), "{},{},{},{},{},{},{},{},{},{:d},{:.3f},{:.3f},{:d},", i, one.scene,
                   csv_quoted(results.setting.maps[one.map]), csv_quoted(results.driver_name(one.driver)), one.step,
                   one.ego, one.user, one.hidden < 0 ? "" : std::to_string(one.hidden), to_string(one.user_class),
                   one.user_halted, one.distance_m, one.ego_speed_mps, one.is_in_frame());
    if (one.is_in_frame()) fmt::format_to(std::back_inserter(text), "{}", one.occlusion());
    text += response_fields(results, i);
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
  std::vector<int32_t> drivers;
  for (const RemovalCase& one : results.cases) drivers.push_back(one.driver);
  Json json = {{"kind", "removal"},
               {"policy", policies_json(results, drivers)},
               {"control", kRemovalControlNames[static_cast<size_t>(results.control)]},
               {"cases", results.cases.size()},
               {"cases_asked", results.removals_asked},
               {"cases_file", cases_file.empty() ? Json(nullptr) : Json(cases_file)},
               {"range_m", results.range_m}};
  return summary_text(results, std::move(json), rows,
                      [&results](const RemovalRow& row) { return to_json(row, results); });
}

}  // namespace pictura
