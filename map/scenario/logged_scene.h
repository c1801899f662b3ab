// A scene as its file has it, in the file's coordinates and double precision: what every reader fills and
// make_scenario() converts, so that each rule of conversion exists once.
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

/// The points [begin, end] of this lane's centre line along which `feature` is its border.
struct LoggedBoundary {
  int32_t begin = 0, end = 0;
  int64_t feature = 0;  // id of a line or an edge
};

/// The points [begin, end] of this lane's centre line along which `lane` runs beside it.
struct LoggedNeighbor {
  int32_t begin = 0, end = 0;
  int64_t lane = 0;
};

struct LoggedLane {
  int64_t id = 0;
  LoggedLaneType type = LoggedLaneType::undefined;
  std::optional<LaneType> map_type;  // instead of `type`, where a program states it
  double speed_limit_mps = 0;        // 0: unknown
  bool interpolating = false;        // connects two lanes, in a junction
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
  dash_white,  // one dash as long as the line
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
  Eigen::Vector3d center_m{0, 0, 0};  // of the box; of its foot where LoggedScene::is_stated
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

/// A light for some lanes. Without a stop line of its own, one is laid across the lanes' starts.
struct LoggedLight {
  std::vector<int64_t> lanes;
  bool has_stop_line = false;
  Eigen::Vector3d stop_a_m{0, 0, 0}, stop_b_m{0, 0, 0};
  std::vector<RecordedLightState> states;  // [num_steps]
};

/// How a reader names its parts in messages.
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
  std::vector<LoggedEdge> edges;  // the road on their left
  std::vector<LoggedPolygon> crosswalks;
  std::vector<LoggedStopSign> stop_signs;
  std::vector<LoggedLight> lights;
  bool has_links = true;  // else lanes are linked where their ends meet
  /// A program states the scene instead of a recording's file, so nothing is guessed: types of lanes, directions of
  /// links, sides and gaps of edges, and which lights are one are as stated. Points are rounded first, so that what a
  /// scenario holds can be stated again (state_scene()) and gives the same scenario.
  bool is_stated = false;
  double tolerance_m = 0.02;                // how far thinned polylines may deviate; 0: all points are kept
  std::optional<Eigen::Vector3d> origin_m;  // of the map; else the centre of lanes and edges
  std::vector<ConversionNote> notes;

  /// Counts an occurrence of `what`; the first one's place is kept.
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

/// The scenario of a scene. Throws Error "SOURCE: FIELD: expected ..., got ..." when a valid state or a point of the
/// map is not finite or lies beyond 10 km of the scene's centre, when there is no lane of two points or no track, and
/// when the map would need more points than scenes may have.
Scenario make_scenario(LoggedScene scene);

/// What make_scenario() makes the same scenario of, but for what a LoggedScene has no place for: walls, parking spaces,
/// painted stop lines, signs that are no stop signs, widths and colours of marks other than white and yellow, the
/// lights of the map itself, and SavedMotion. A double line comes back as two stripes, a broken one as its dashes.
/// Lanes have the ids of the file where each has one of its own, else their numbers.
LoggedScene state_scene(const Scenario& scenario);

}  // namespace pictura
