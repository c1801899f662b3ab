// Results of the tracked-pedestrian probe.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/evaluation/probes/probe_results.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

enum class PedestrianControl : uint8_t {
  none,
  unchanged,  // control: no pedestrian is inserted, so no response may change
  untrained,  // control: the policies have fresh weights
};
constexpr std::array<const char*, 3> kPedestrianControlNames{"none", "unchanged", "untrained"};

enum class PathPhase : uint8_t { hidden, seen, hidden_again };
constexpr std::array<const char*, 3> kPathPhaseNames{"hidden", "seen", "hidden again"};

/// Path in a frozen state. Box indices are within their world: agents, then parked cars.
struct PedestrianPath {
  int32_t scene = 0, map = 0, driver = 0;  // scene: scenario number; map, driver: indices
  std::array<double, 3> map_origin_m{};    // file coordinates of the map's origin
  int32_t step = 0;                        // completed steps
  int32_t ego = 0, hider = 0;              // hider: box behind which the path begins
  float ego_speed_mps = 0, hider_distance_m = 0;
  int32_t first_point = 0, num_points = 0;   // range in PedestrianResults::points
  int32_t first_seen = 0, hidden_again = 0;  // first points of these phases within the range
  // For figures:
  std::vector<AgentBox> boxes;
  std::vector<AgentStatus> status;  // [boxes]
  std::vector<LightState> lights;
  View view;  // the ego's view in a scene of only this world

  PathPhase phase_of(int32_t point) const {
    const int32_t at = point - first_point;
    return at < first_seen ? PathPhase::hidden : at < hidden_again ? PathPhase::seen : PathPhase::hidden_again;
  }
};

/// Pedestrian at one point of a path.
struct PedestrianPoint {
  int32_t path = 0;   // index
  float along_m = 0;  // from the path's first point
  AgentBox pedestrian;
  float distance_m = 0;     // on the ground, from the ego's rear axle
  float visible_share = 0;  // see Renderer::visibility
};

struct PedestrianResults : ProbeResults {
  int64_t paths_asked = 0;
  float hider_range_m = 0, min_speed_mps = 0, height_m = 0;
  PedestrianControl control = PedestrianControl::none;
  std::vector<PedestrianPath> paths;    // ordered by scene, step, ego and hider
  std::vector<PedestrianPoint> points;  // ordered by path and along_m
  CompiledMaps maps;                    // for figures, as are the cameras
  RendererConfig cameras;
};

/// Mean responses of one policy to all points of a phase, or to all points at one offset from the first seen point.
struct PedestrianRow : ResponseMeans {
  int policy = 0;
  std::optional<PathPhase> phase;
  std::optional<int> offset;  // in points
  double mean_visible_share = 0;
};

/// Returns each policy's phases, then its ascending offsets.
std::vector<PedestrianRow> summarize(const PedestrianResults& results);

/// Writes a CSV row per point, which ends with the columns of response_header(). Throws Error naming the path.
void write_pedestrian_cases(const std::string& path, const PedestrianResults& results);

/// Returns one JSON object. `cases_file`: path of the CSV file, or empty.
std::string pedestrian_summary_json(const PedestrianResults& results, const std::vector<PedestrianRow>& rows,
                                    const std::string& cases_file);

}  // namespace pictura
