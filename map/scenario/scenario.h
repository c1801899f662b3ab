// Scenario: recorded traffic, in the coordinates of its map. docs/reference/scenario.md describes its derivation.
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

/// State of a road user at one step; zero if invalid.
struct TrackState {
  Vec3 position_m;  // centre of the box's bottom face
  float heading_rad = 0;
  Vec2 velocity_mps;
};

/// Simulator state of a saved simulation, for a bitwise identical replay.
struct SavedMotion {
  Vec3 reference_m;     // rear axle of a vehicle or cyclist, or centre of a pedestrian
  float speed_mps = 0;  // signed, along the heading
};

/// Controller of a track, according to the file.
enum class RecordedControl : uint8_t {
  unstated,
  controllable,  // a policy may drive the track
  expert,        // the track should be replayed
  still,         // the road user never moves
};
const char* to_string(RecordedControl control);

struct RecordedTrack {
  int64_t id = 0;
  TrackType type = TrackType::unset;
  RecordedControl control = RecordedControl::unstated;
  float length_m = 0, width_m = 0, height_m = 0;  // at current_step if valid there, else in the last valid state
  int32_t first_valid = 0, last_valid = 0;        // the track may have gaps between these steps
  int32_t num_valid = 0;                          // at least one
};

/// State of a light, as named by the Waymo Open Motion Dataset.
enum class RecordedLightState : uint8_t {
  none,  // unknown, off, or not visible
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

/// A traffic light and the lanes that it controls.
struct RecordedLight {
  Vec3 stop_a_m, stop_b_m;     // left end first, as seen by traffic
  float stop_heading_rad = 0;  // heading of the controlled traffic
  IndexRange lanes;            // in Scenario::light_lanes
};

struct PredictedTrack {
  int32_t track = 0;
  int32_t difficulty = 0;
};

/// An omission or change during the conversion.
struct ConversionNote {
  std::string what;  // "lanes of a single point left out"
  int32_t count = 0;
  std::string first;  // first place, such as "lane 117"
};

struct Scenario {
  std::string id;      // such as "637f20cafde22ff8"; may be empty
  std::string format;  // "womd", "gpudrive", "pufferdrive v1", ...
  float dt_s = 0.1f;
  int32_t num_steps = 0;
  int32_t current_step = 0;  // last step of the history that predictors receive
  int32_t sdc_track = -1;    // self-driving car; -1: unknown
  RoadMap map;
  std::vector<RecordedTrack> tracks;
  std::vector<TrackState> states;   // [tracks * num_steps]
  std::vector<uint8_t> valid;       // [tracks * num_steps]
  std::vector<SavedMotion> driven;  // [tracks * num_steps], or empty for recordings of real roads
  std::vector<int32_t> objects_of_interest;
  std::vector<PredictedTrack> tracks_to_predict;
  std::vector<RecordedLight> lights;
  std::vector<int32_t> light_lanes;
  std::vector<RecordedLightState> light_states;  // [lights * num_steps]
  std::vector<ConversionNote> notes;
  int32_t repaired_headings = 0;  // number of tracks whose first heading was replaced by protocol_scene()

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

constexpr int32_t kMaxScenarioSteps = 10'000, kMaxScenarioTracks = 65'536;

/// Throws Error, which names the element, if the map, an index, a size, a state or a track's summary is invalid.
void validate(const Scenario& scenario);

/// See difference_of() in field_difference.h.
std::string first_difference(const Scenario& a, const Scenario& b);

struct ScenarioFacts {
  int32_t vehicles = 0, pedestrians = 0, cyclists = 0, others = 0;
  int32_t moving_vehicles = 0;        // see is_moving()
  int32_t tracks_with_gaps = 0;       // invalid states between valid states
  int32_t recorded_light_states = 0;  // steps with a known state, summed over lights
};
constexpr float kMovingTrack_m = 2.0f;
ScenarioFacts facts_of(const Scenario& scenario);

/// Whether the first and last valid positions are at least kMovingTrack_m apart.
bool is_moving(const Scenario& scenario, int32_t track);

}  // namespace pictura
