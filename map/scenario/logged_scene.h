// Contents of a recorded scene's file, in the file's coordinates. All readers fill this structure, and make_scenario()
// converts it.
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

/// Part of a lane's border: `feature` is the border along points [begin, end] of the lane's centre line.
struct LoggedBoundary {
  int32_t begin = 0, end = 0;
  int64_t feature = 0;  // id of a line or an edge
};

/// `lane` is beside points [begin, end] of the lane's centre line.
struct LoggedNeighbor {
  int32_t begin = 0, end = 0;
  int64_t lane = 0;
};

struct LoggedLane {
  int64_t id = 0;
  LoggedLaneType type = LoggedLaneType::undefined;
  std::optional<LaneType> map_type;  // overrides `type` in authored scenes
  double speed_limit_mps = 0;        // 0: unknown
  bool interpolating = false;        // connects two lanes in a junction
  LoggedPoints points;
  std::vector<double> widths_m;  // [points]; empty: unknown
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
  dash_white,  // a dash as long as the line
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

/// A missing stop line is placed across the starts of the lanes.
struct LoggedLight {
  std::vector<int64_t> lanes;
  bool has_stop_line = false;
  Eigen::Vector3d stop_a_m{0, 0, 0}, stop_b_m{0, 0, 0};
  std::vector<RecordedLightState> states;  // [num_steps]
};

/// Names of a format's fields in messages.
struct LoggedNames {
  const char* tracks = "tracks";
  const char* features = "map_features";
};

struct LoggedScene {
  std::string source;  // in messages: "FILE: record 3 (scenario abc)"
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
  /// Whether the scene is authored: made by a caller (Scenario.from_arrays) or by scene_of_scenario(), not read from a
  /// dataset. Then nothing is inferred: types, links, edges and groups of lights are used as they are. Points are
  /// rounded to the precision of a map, so scene_of_scenario() followed by make_scenario() returns the same scenario.
  bool is_authored = false;
  double tolerance_m = 0.02;                // maximum deviation of thinned polylines; 0: no thinning
  std::optional<Eigen::Vector3d> origin_m;  // by default the centre of lanes and edges
  std::vector<ConversionNote> notes;

  /// Counts `what`, and records the first occurrence's place.
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

/// Throws Error "SOURCE: FIELD: expected ..., got ..." for data that a Scenario cannot hold. Examples are points that
/// are not finite or are more than 10 km from the centre, and scenes without lanes or tracks.
Scenario make_scenario(LoggedScene scene);

/// Inverse of make_scenario(), except for data that a LoggedScene lacks: walls, parking spaces, painted stop lines,
/// signs except stop signs, the map's own lights, SavedMotion, widths of marks, and mark colours except white and
/// yellow. Double lines become two stripes, and broken lines become dashes. Lanes and tracks keep the ids of the file
/// if these are unique.
LoggedScene scene_of_scenario(const Scenario& scenario);

}  // namespace pictura
