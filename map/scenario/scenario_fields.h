// Fields of Scenario and its elements (see map_fields.h), and limits.
#pragma once

#include "pictura/map/field_difference.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

PICTURA_FIELDS(TrackState, position_m, heading_rad, velocity_mps)
PICTURA_FIELDS(SavedMotion, reference_m, speed_mps)
PICTURA_FIELDS(RecordedTrack, id, type, control, length_m, width_m, height_m, first_valid, last_valid, num_valid)
PICTURA_FIELDS(RecordedLight, stop_a_m, stop_b_m, stop_heading_rad, lanes)
PICTURA_FIELDS(PredictedTrack, track, difficulty)
PICTURA_FIELDS(ConversionNote, what, count, first)
PICTURA_FIELDS(Scenario, id, format, dt_s, num_steps, current_step, sdc_track, map, tracks, states, valid, driven,
               objects_of_interest, tracks_to_predict, lights, light_lanes, light_states, notes, repaired_headings)

/// Maximum distance from a scene's origin.
constexpr float kMaxScenarioRadius_m = 1e4f;
constexpr float kMaxTrackSize_m = 100.0f;

}  // namespace pictura
