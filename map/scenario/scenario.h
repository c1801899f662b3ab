// Scenario: recorded traffic from any file format. It consists of a map, the tracks of all road users, and the recorded
// traffic lights. Positions are in the coordinates of the scenario's map. docs/reference/scenario.md describes the
// derivation of each part.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/span.h"
#include "pictura/map/road_map.h"

namespace pictura {

enum class TrackType : uint8_t { unset, vehicle, pedestrian, cyclist, other };
const char* to_string(TrackType type);

/// State of a road user at one step. All members are 0 if the recording has no valid state.
struct TrackState {
  Vec3 position_m;  // centre of the box's bottom face
  float heading_rad = 0;
  Vec2 velocity_mps;
};

/// Additional simulator state of a saved simulation, so that a replay is bitwise identical.
struct SavedMotion {
  Vec3 reference_m;     // reference point of the road user's class
  float speed_mps = 0;  // signed, along the heading
};

/// The file's statement about the controller of a track.
enum class RecordedControl : uint8_t {
  unstated,
  controllable,  // a policy may drive the track
  expert,        // the track should be replayed
  still,         // the road user never moves
};
const char* to_string(RecordedControl control);

struct RecordedTrack {
  int64_t id = 0;  // as in the file
  TrackType type = TrackType::unset;
  RecordedControl control = RecordedControl::unstated;
  float length_m = 0, width_m = 0, height_m = 0;  // size in the last valid state
  int32_t first_valid = 0, last_valid = 0;        // steps; between them, the track may have gaps
  int32_t num_valid = 0;                          // at least one
};

/// Recorded state of a traffic light, with the names of the Waymo Open Motion Dataset.
enum class RecordedLightState : uint8_t {
  none,  // unknown, off, or not visible at that step
  arrow_stop,
  arrow_caution,
  arrow_go,
  stop,
  caution,
  go,
  flashing_stop,
  flashing_caution,
};
const char* to_string(RecordedLightState state);

/// A recorded traffic light: the lanes that it controls, and its stop line (by default across the starts of these
/// lanes).
struct RecordedLight {
  Vec3 stop_a_m, stop_b_m;     // left end first as seen by traffic
  float stop_heading_rad = 0;  // travel direction of the controlled traffic
  IndexRange lanes;            // in Scenario::light_lanes
};

/// A track that a file marks for prediction.
struct PredictedTrack {
  int32_t track = 0;
  int32_t difficulty = 0;
};

/// A kind of omission or change that was made during the conversion from the file.
struct ConversionNote {
  std::string what;   // "lanes of a single point left out"
  int32_t count = 0;  // number of occurrences
  std::string first;  // place of the first occurrence, such as "lane 117"
};

struct Scenario {
  std::string id;      // id of the recording, such as "637f20cafde22ff8"; may be empty
  std::string format;  // "womd", "gpudrive", "pufferdrive v1", ...
  float dt_s = 0.1f;
  int32_t num_steps = 0;
  int32_t current_step = 0;  // last step of the history that predictors receive
  int32_t sdc_track = -1;    // the self-driving car; -1: unknown
  RoadMap map;
  std::vector<RecordedTrack> tracks;
  std::vector<TrackState> states;   // [tracks * num_steps]
  std::vector<uint8_t> valid;       // [tracks * num_steps] 0 or 1
  std::vector<SavedMotion> driven;  // [tracks * num_steps]; empty for recordings of real roads
  std::vector<int32_t> objects_of_interest;
  std::vector<PredictedTrack> tracks_to_predict;
  std::vector<RecordedLight> lights;
  std::vector<int32_t> light_lanes;
  std::vector<RecordedLightState> light_states;  // [lights * num_steps]
  std::vector<ConversionNote> notes;
  int32_t repaired_headings = 0;  // number of first headings that protocol_scene() replaced

  Span<const TrackState> states_of(int32_t track) const {
    return {states.data() + first_of(track), static_cast<size_t>(num_steps)};
  }
  Span<const uint8_t> valid_of(int32_t track) const {
    return {valid.data() + first_of(track), static_cast<size_t>(num_steps)};
  }
  Span<const RecordedLightState> states_of_light(int32_t light) const {
    return {light_states.data() + first_of(light), static_cast<size_t>(num_steps)};
  }

 private:
  size_t first_of(int32_t item) const { return static_cast<size_t>(item) * static_cast<size_t>(num_steps); }
};

/// Maximum numbers of steps and tracks, which importers and validate() enforce.
constexpr int32_t kMaxScenarioSteps = 10'000, kMaxScenarioTracks = 65'536;

/// Throws Error, which names the element, if the map, an index, a size or a state is invalid, or if the summary of a
/// track does not agree with its states.
void validate(const Scenario& scenario);

/// Returns the first bitwise difference of two scenarios, such as "tracks[3].length_m: 4 and 5". Returns an empty
/// string if the scenarios are equal.
std::string first_difference(const Scenario& a, const Scenario& b);

/// Counts that `pictura map` prints.
struct ScenarioFacts {
  int32_t vehicles = 0, pedestrians = 0, cyclists = 0, others = 0;
  int32_t moving_vehicles = 0;        // vehicles for which is_moving() is true
  int32_t tracks_with_gaps = 0;       // tracks with invalid states between valid states
  int32_t recorded_light_states = 0;  // number of steps with a known state, summed over lights
};
constexpr float kMovingTrack_m = 2.0f;
ScenarioFacts facts_of(const Scenario& scenario);

/// Whether the track's last valid position is at least kMovingTrack_m from its first.
bool is_moving(const Scenario& scenario, int32_t track);

}  // namespace pictura
