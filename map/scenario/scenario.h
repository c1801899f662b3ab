// Scenario: a recorded piece of traffic, whatever the file format: a map, the tracks of all road users, and the lights
// as they were recorded. Positions are in the coordinates of its map; docs/reference/scenario.md says how each part is
// derived.
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

/// A road user at one step. All zero where the recording has no valid state.
struct TrackState {
  Vec3 position_m;  // centre of the box's foot
  float heading_rad = 0;
  Vec2 velocity_mps;
};

/// Of a run that was saved: what the simulator had besides, so that a replay has the same bits.
struct SavedMotion {
  Vec3 reference_m;     // the reference point of its class
  float speed_mps = 0;  // signed, along the heading
};

/// What a file says of who should drive a track.
enum class RecordedControl : uint8_t {
  unstated,
  controllable,  // a policy may drive it
  expert,        // it should be replayed
  still,         // it stands throughout
};
const char* to_string(RecordedControl control);

struct RecordedTrack {
  int64_t id = 0;  // as in the file
  TrackType type = TrackType::unset;
  RecordedControl control = RecordedControl::unstated;
  float length_m = 0, width_m = 0, height_m = 0;  // of its last valid state
  int32_t first_valid = 0, last_valid = 0;        // steps; there may be gaps between them
  int32_t num_valid = 0;                          // at least one
};

/// A light as recorded; the names are WOMD's.
enum class RecordedLightState : uint8_t {
  none,  // unknown, off, or not seen at that step
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

/// Lanes that one light controls, with its stop line across their starts.
struct RecordedLight {
  Vec3 stop_a_m, stop_b_m;     // left end first as seen by traffic
  float stop_heading_rad = 0;  // travel direction of the controlled traffic
  IndexRange lanes;            // Scenario::light_lanes
};

/// A track that a file asks to predict.
struct PredictedTrack {
  int32_t track = 0;
  int32_t difficulty = 0;
};

/// What was left out or changed on the way from the file, by kind.
struct ConversionNote {
  std::string what;   // "lanes of a single point left out"
  int32_t count = 0;  // how often
  std::string first;  // the first place: "lane 117"
};

struct Scenario {
  std::string id;      // the recording's, such as "637f20cafde22ff8"; may be empty
  std::string format;  // "womd", "gpudrive", "pufferdrive v1", ...
  float dt_s = 0.1f;
  int32_t num_steps = 0;
  int32_t current_step = 0;  // the last step of the history that a predictor is given
  int32_t sdc_track = -1;    // the self-driving car; -1: not known
  RoadMap map;
  std::vector<RecordedTrack> tracks;
  std::vector<TrackState> states;   // [tracks * num_steps]
  std::vector<uint8_t> valid;       // [tracks * num_steps] 0 or 1
  std::vector<SavedMotion> driven;  // [tracks * num_steps], or empty: recorded on real roads
  std::vector<int32_t> objects_of_interest;
  std::vector<PredictedTrack> tracks_to_predict;
  std::vector<RecordedLight> lights;
  std::vector<int32_t> light_lanes;
  std::vector<RecordedLightState> light_states;  // [lights * num_steps]
  std::vector<ConversionNote> notes;

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

/// Bounds that importers and validate() hold.
constexpr int32_t kMaxScenarioSteps = 10'000, kMaxScenarioTracks = 65'536;

/// Throws Error naming the element unless the map is valid, every index, size and state is, and the tracks' summaries
/// agree with their states.
void validate(const Scenario& scenario);

/// The first bitwise difference of two scenarios, as a path like "tracks[3].length_m: 4 and 5"; empty when they are
/// equal.
std::string first_difference(const Scenario& a, const Scenario& b);

/// Counts for `pictura map`.
struct ScenarioFacts {
  int32_t vehicles = 0, pedestrians = 0, cyclists = 0, others = 0;
  int32_t moving_vehicles = 0;        // ends at least kMovingTrack_m from its start
  int32_t tracks_with_gaps = 0;       // absent between valid states
  int32_t recorded_light_states = 0;  // light-steps with a state
};
constexpr float kMovingTrack_m = 2.0f;
ScenarioFacts facts_of(const Scenario& scenario);

/// Whether the track's last valid position is at least kMovingTrack_m from its first.
bool is_moving(const Scenario& scenario, int32_t track);

}  // namespace pictura
