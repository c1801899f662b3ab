#include "pictura/evaluation/probes/pedestrian_results.h"

#include <algorithm>
#include <map>

#include "pictura/common/error.h"
#include "pictura/common/support/output_file.h"
#include "pictura/evaluation/csv.h"
#include "pictura/evaluation/probes/crossing_path.h"
#include "pictura/evaluation/probes/probe_json.h"
#include "pictura/map/file_position.h"

namespace pictura {

namespace {

// Sums over points for one policy.
struct PointSums {
  ResponseSums responses;
  double visible_share = 0;

  void add(int32_t scene, const PedestrianPoint& point, const PairedResponse& response) {
    responses.add(scene, response);
    visible_share += static_cast<double>(point.visible_share);
  }
  PedestrianRow row(int policy) const {
    PedestrianRow row{responses.means(), policy, {}, {}, 0};
    row.mean_visible_share = visible_share / static_cast<double>(row.cases);
    return row;
  }
};

Json to_json(const PedestrianRow& row, const PedestrianResults& results) {
  Json json = {
      {"policy", results.policies[row.policy].name},
      {"phase", row.phase ? Json(kPathPhaseNames[static_cast<size_t>(*row.phase)]) : Json(nullptr)},
      {"from_first_sight_m", row.offset ? Json(*row.offset * static_cast<double>(kPathSpacing_m)) : Json(nullptr)},
      {"visible_share_mean", finite_or_null(row.mean_visible_share)}};
  add_means(row, &json);
  return json;
}

}  // namespace

std::vector<PedestrianRow> summarize(const PedestrianResults& results) {
  std::vector<PedestrianRow> rows;
  for (size_t policy = 0; policy < results.policies.size(); ++policy) {
    std::array<PointSums, kPathPhaseNames.size()> phases;
    std::map<int, PointSums> offsets;
    for (size_t i = 0; i < results.points.size(); ++i) {
      const PedestrianPoint& point = results.points[i];
      const PedestrianPath& path = results.paths[point.path];
      const auto at = static_cast<int32_t>(i);
      const PairedResponse& response = results.response(i, policy);
      phases[static_cast<size_t>(path.phase_of(at))].add(path.scene, point, response);
      offsets[at - path.first_point - path.first_seen].add(path.scene, point, response);
    }
    for (size_t phase = 0; phase < phases.size(); ++phase) {
      rows.push_back(phases[phase].row(static_cast<int>(policy)));
      rows.back().phase = static_cast<PathPhase>(phase);
    }
    for (const auto& [offset, sums] : offsets) {
      rows.push_back(sums.row(static_cast<int>(policy)));
      rows.back().offset = offset;
    }
  }
  return rows;
}

void write_pedestrian_cases(const std::string& path, const PedestrianResults& results) {
  OutputFile file(path);
  file.write(
      "case,path,scene,map,driver,step,ego,ego_speed_mps,hider,hider_distance_m,along_m,from_first_sight_m,x_m,y_m,z_m,"
      "distance_m,phase,visible_share" +
      response_header(results) + '\n');
  for (size_t i = 0; i < results.points.size(); ++i) {
    const PedestrianPoint& point = results.points[i];
    const PedestrianPath& one = results.paths[point.path];
    const auto at = static_cast<int32_t>(i);
    const std::array<double, 3> position_m = file_position_m(one.map_origin_m, point.pedestrian.center_m);
    file.write(fmt::format(
        "{},{},{},{},{},{},{},{:.3f},{},{:.3f},{},{},{:.3f},{:.3f},{:.3f},{:.3f},{},{}{}\n", i, point.path, one.scene,
        csv_quoted(results.setting.maps[one.map]), csv_quoted(results.driver_name(one.driver)), one.step, one.ego,
        one.ego_speed_mps, one.hider, one.hider_distance_m, point.along_m,
        static_cast<float>(at - one.first_point - one.first_seen) * kPathSpacing_m, position_m[0], position_m[1],
        position_m[2], point.distance_m, kPathPhaseNames[static_cast<size_t>(one.phase_of(at))], point.visible_share,
        response_fields(results, i)));
  }
  file.commit();
}

std::string pedestrian_summary_json(const PedestrianResults& results, const std::vector<PedestrianRow>& rows,
                                    const std::string& cases_file) {
  std::vector<int32_t> drivers;
  for (const PedestrianPoint& point : results.points) drivers.push_back(results.paths[point.path].driver);
  Json json = {{"kind", "pedestrian"},
               {"policy", policies_json(results, drivers)},
               {"control", kPedestrianControlNames[static_cast<size_t>(results.control)]},
               {"paths", results.paths.size()},
               {"paths_asked", results.paths_asked},
               {"cases", results.points.size()},
               {"cases_file", cases_file.empty() ? Json(nullptr) : Json(cases_file)},
               {"spacing_m", kPathSpacing_m},
               {"hider_range_m", results.hider_range_m},
               {"min_speed_mps", results.min_speed_mps},
               {"height_m", results.height_m}};
  return summary_text(results, std::move(json), rows,
                      [&results](const PedestrianRow& row) { return to_json(row, results); });
}

}  // namespace pictura
