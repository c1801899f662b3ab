// A recorded scene with the contents of its file, in the file's coordinates and in double precision. All readers fill
// this structure, and make_scenario() converts it, so that each rule of conversion exists only once.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include <Eigen/Core>

#include "pictura/common/error_types.h"
#include "pictura/map/scenario/field_error.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

using LoggedPoints = std::vector<Eigen::Vector3d>;

enum class LoggedLaneType : uint8_t { undefined, freeway, surface, bike, bus };

/// Part of a lane's border: `feature` is the border along the points [begin, end] of the lane's centre line.
struct LoggedBoundary {
  int32_t begin = 0, end = 0;
  int64_t feature = 0;  // id of a line or an edge
};

/// A neighbour of a lane: `lane` is beside the points [begin, end] of the lane's centre line.
struct LoggedNeighbor {
  int32_t begin = 0, end = 0;
  int64_t lane = 0;
};

struct LoggedLane {
  int64_t id = 0;
  LoggedLaneType type = LoggedLaneType::undefined;
  std::optional<LaneType> map_type;  // overrides `type` if a program wrote the scene
  double speed_limit_mps = 0;        // 0: unknown
  bool interpolating = false;        // connects two lanes in a junction
  LoggedPoints points;
  std::vector<double> widths_m;  // [points], or empty: unknown
  std::vector<int64_t> entries, exits;
  std::vector<LoggedNeighbor> left_neighbors, right_neighbors;
  std::vector<LoggedBoundary> left_boundaries, right_boundaries;
};

enum class LoggedLineType : uint8_t {
  unknown,
  broken_single_white,
  solid_single_white,
  solid_double_white,
  broken_single_yellow,
  broken_double_yellow,
  solid_single_yellow,
  solid_double_yellow,
  passing_double_yellow,
  dash_white,  // a single dash as long as the line
  dash_yellow,
};

struct LoggedLine {
  int64_t id = 0;
  LoggedLineType type = LoggedLineType::unknown;
  LoggedPoints points;
};

struct LoggedEdge {
  int64_t id = 0;
  LoggedPoints points;
};

struct LoggedStopSign {
  int64_t id = 0;
  std::vector<int64_t> lanes;
  Eigen::Vector3d position_m{0, 0, 0};
};

struct LoggedPolygon {
  int64_t id = 0;
  LoggedPoints points;
};

struct LoggedState {
  Eigen::Vector3d center_m{0, 0, 0};  // centre of the box, or of its bottom face if LoggedScene::is_authored
  double heading_rad = 0;
  double velocity_x_mps = 0, velocity_y_mps = 0;
  double length_m = 0, width_m = 0, height_m = 0;
  bool valid = false;
};

struct LoggedTrack {
  int64_t id = 0;
  TrackType type = TrackType::unset;
  RecordedControl control = RecordedControl::unstated;
  std::vector<LoggedState> states;  // [num_steps]
};

/// A traffic light for some lanes. If it has no stop line, it gets a stop line across the starts of its lanes.
struct LoggedLight {
  std::vector<int64_t> lanes;
  bool has_stop_line = false;
  Eigen::Vector3d stop_a_m{0, 0, 0}, stop_b_m{0, 0, 0};
  std::vector<RecordedLightState> states;  // [num_steps]
};

/// Names that messages use for the fields of a file format.
struct LoggedNames {
  const char* tracks = "tracks";
  const char* features = "map_features";
};

struct LoggedScene {
  std::string source;  // "FILE: record 3 (scenario abc)", for messages
  LoggedNames names;
  std::string id, name, format;
  double dt_s = 0.1;
  int32_t num_steps = 0, current_step = 0;
  int32_t sdc_track = -1;
  std::vector<LoggedTrack> tracks;
  std::vector<int64_t> objects_of_interest;              // ids of tracks
  std::vector<std::pair<int32_t, int32_t>> predictions;  // index of a track, difficulty
  std::vector<LoggedLane> lanes;
  std::vector<LoggedLine> lines;
  std::vector<LoggedEdge> edges;  // the road is on their left
  std::vector<LoggedPolygon> crosswalks;
  std::vector<LoggedStopSign> stop_signs;
  std::vector<LoggedLight> lights;
  bool has_links = true;  // if false, lanes are linked where their ends meet
  /// Whether the scene is the work of a program, not a recording. In such a scene, nothing is inferred. Types of lanes,
  /// directions of links, sides and gaps of edges, and the grouping of lights are used as they are. Points are rounded
  /// to the precision of a map. So the scenario does not change if scene_of_scenario() and make_scenario() are applied
  /// to it.
  bool is_authored = false;
  double tolerance_m = 0.02;                // maximum deviation of thinned polylines; 0: all points are kept
  std::optional<Eigen::Vector3d> origin_m;  // origin of the map; by default the centre of lanes and edges
  std::vector<ConversionNote> notes;

  /// Counts an occurrence of `what`, and records the place of the first occurrence.
  void note(const std::string& what, const std::string& place) {
    for (ConversionNote& known : notes) {
      if (known.what == what) {
        ++known.count;
        return;
      }
    }
    notes.push_back({what, 1, place});
  }
};

/// Converts a scene to a scenario. Throws Error "SOURCE: FIELD: expected ..., got ..." if a valid state or a point of
/// the map is not finite or is more than 10 km from the scene's centre. Also throws Error if no lane has at least two
/// points, if there is no track, or if the map would need more points than the limit for scenes.
Scenario make_scenario(LoggedScene scene);

/// Inverse of make_scenario(), except for data that a LoggedScene cannot hold: walls, parking spaces, painted stop
/// lines, signs other than stop signs, widths of marks, marks that are neither white nor yellow, the traffic lights of
/// the map itself, and SavedMotion. A double line becomes two stripes, and a broken line becomes its dashes. Lanes have
/// the ids of the file if these are unique, else their indices.
LoggedScene scene_of_scenario(const Scenario& scenario);

}  // namespace pictura
