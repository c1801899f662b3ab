// Options of procedural towns: seed, size, and the amount of each feature; the families of towns and their names.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"

namespace pictura {

/// Fractions lie in [0, 1]. A fraction of some elements selects at least one of them unless it is 0.
struct TownOptions {
  uint64_t seed = 0;
  int blocks_x = 3, blocks_y = 3;  // blocks, in [1, 32] each
  double block_m = 90;             // mean distance between crossings
  double density = 0.9;            // fraction of the removable streets that are kept
  double curved = 0.6;             // of the streets
  double five_arms = 0.2;          // of the inner crossings, made by a diagonal street
  double roundabouts = 0.2;        // of the crossings of streets with at most roundabout_lanes
  double roundabout_lanes = 1;     // maximum, of a roundabout and each way of its arms
  double avenues = 0.2;            // of the inner rows and columns: two or more lanes each way
  double max_lanes = 3;            // each way, of avenues and the ring road
  double ring_road = 1;            // chance that an avenue runs around the town
  double motorway = 0;             // chance that a motorway runs around the town
  double slip_lanes = 0.1;         // of the right turns at lights that are large enough
  double lane_spread_m = 0;        // maximum difference of the width of the town's lanes from 3.5 m
  double hills_m = 6;              // maximum height difference, before grades are limited
  double overpasses = 0.1;         // of the inner crossings of four arms
  double crosswalks = 0.9;         // of the crossings
  double sidewalks = 0.95;         // of the streets
  double parking = 0.4;            // of the sides of single-lane streets
  double lights = 0.8;             // of the crossings that are no roundabouts
  double far_side = 0.5;           // of the crossings with lights: heads beyond the junction
};

/// A numeric option: its name in commands and map names, its range and its help text.
struct TownFeature {
  const char* name;
  double TownOptions::* value;
  double low, high;
  const char* help;
  bool is_whole = false;
};

const std::vector<TownFeature>& town_features();
constexpr int kMaxTownBlocks = 32;

/// Throws UsageError naming the option, its range and its value.
void check_town_options(const TownOptions& options);

/// Towns that share the defaults of their options; their maps' names begin with the family's.
struct TownFamily {
  const char* name;
  TownOptions defaults;
};

/// `procedural`, small towns; `city`, with two-lane roundabouts, a motorway, and parking on both sides.
const std::vector<TownFamily>& town_families();

/// The family of a map named `FAMILY` or `FAMILY:...`, or nullptr when the name is of another kind.
const TownFamily* town_family_of(std::string_view map_name);

/// Parses `FAMILY[:SEED[:NAME=VALUE,...]]`, where NAME is `blocks` (as AxB) or a feature's name. Nothing when the name
/// is of another kind; throws UsageError for bad options.
std::optional<TownOptions> parse_town_name(std::string_view map_name);

}  // namespace pictura
