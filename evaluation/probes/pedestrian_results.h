// Results of the tracked-pedestrian probe: responses of policies at every point of the paths, means of them, and files
// of both. The pedestrian walks out from behind a vehicle, while the rest of the state is fixed. Includes no torch
// headers.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/evaluation/probes/probe_results.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Controls of the probe.
enum class PedestrianControl : uint8_t {
  none,
  nobody,     // a control: no pedestrian is inserted, so no response may change
  untrained,  // a control: the pedestrian is inserted, and policies with fresh weights respond in the same states
};
constexpr std::array<const char*, 3> kPedestrianControlNames{"none", "nobody", "untrained"};

/// Phase of a path.
enum class PathPhase : uint8_t { hidden, seen, hidden_again };
constexpr std::array<const char*, 3> kPathPhaseNames{"hidden", "seen", "hidden again"};

/// Path in a frozen state. Boxes are numbered in their world: agents, then parked cars.
struct PedestrianPath {
  int32_t scene = 0, map = 0, driver = 0;  // number of the scenario; indices of its map and driver
  std::array<double, 3> map_origin_m{};    // file coordinates of the map's origin
  int32_t step = 0;                        // steps done in the scenario
  int32_t ego = 0, hider = 0;              // the hider is the box behind which the path begins
  float ego_speed_mps = 0, hider_distance_m = 0;
  int32_t first_point = 0, num_points = 0;   // the path's range in PedestrianResults::points
  int32_t first_seen = 0, hidden_again = 0;  // first points of these phases, as indices within the path's range
  // State for figures:
  std::vector<AgentBox> boxes;
  std::vector<AgentStatus> status;  // [boxes]
  std::vector<LightState> lights;
  View view;  // view of the ego; indices in it refer to a scene of only this world

  PathPhase phase_of(int32_t point) const {
    const int32_t at = point - first_point;
    return at < first_seen ? PathPhase::hidden : at < hidden_again ? PathPhase::seen : PathPhase::hidden_again;
  }
};

/// One case of the probe: the pedestrian at one point of a path.
struct PedestrianPoint {
  int32_t path = 0;   // index of the path
  float along_m = 0;  // distance from the path's first point
  AgentBox pedestrian;
  float distance_m = 0;     // on the ground, from the ego's rear axle
  float visible_share = 0;  // in the ego's cameras, see Renderer::visibility
};

struct PedestrianResults : ProbeResults {
  int64_t paths_asked = 0;
  float hider_range_m = 0, min_speed_mps = 0, height_m = 0;
  PedestrianControl control = PedestrianControl::none;
  std::vector<PedestrianPath> paths;    // ordered by scene, step, ego and hider
  std::vector<PedestrianPoint> points;  // ordered by path, then along the path
  CompiledMaps maps;                    // for figures, like `cameras`
  RendererConfig cameras;
};

/// Mean responses of one policy: over all points of a phase, or over all paths' points at one offset. The offset is
/// counted from the point at which the pedestrian is first seen.
struct PedestrianRow : ResponseMeans {
  int policy = 0;
  std::optional<PathPhase> phase;
  std::optional<int> offset;      // in points
  double mean_visible_share = 0;  // mean over the cases
};

/// Returns the rows: for each policy the phases, then the offsets in ascending order.
std::vector<PedestrianRow> summarize(const PedestrianResults& results);

/// Writes a CSV file with a header and a row for each point. The columns are the path and its state, the pedestrian's
/// point, and four columns for each policy: value, d_value, p_brake and d_p_brake. Throws Error naming the path.
void write_pedestrian_cases(const std::string& path, const PedestrianResults& results);

/// Returns results and rows as the text of one JSON object. `cases_file` is the path of the file of cases; it may be
/// empty.
std::string pedestrian_summary_json(const PedestrianResults& results, const std::vector<PedestrianRow>& rows,
                                    const std::string& cases_file);

}  // namespace pictura
