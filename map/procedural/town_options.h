// Options of procedural towns: seed, size, and the amount of each feature. Families of towns, and the names of towns.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"

namespace pictura {

/// Options of a town. Fractions are in [0, 1]. A fraction above 0 selects at least one element.
struct TownOptions {
  uint64_t seed = 0;
  int blocks_x = 3, blocks_y = 3;  // number of blocks, in [1, 32] each
  double block_m = 90;             // mean distance between crossings
  double density = 0.9;            // fraction of the removable streets that remain
  double curved = 0.6;             // fraction of the streets that are curved
  double five_arms = 0.2;          // fraction of the inner crossings that get a diagonal street as a fifth arm
  double roundabouts = 0.2;        // fraction of roundabouts among the crossings with narrow enough streets
  double roundabout_lanes = 1;     // maximum lanes of a roundabout, and of each direction of its arms
  double avenues = 0.2;            // fraction of the inner rows and columns that have two or more lanes per direction
  double max_lanes = 3;            // maximum number of lanes in each direction of avenues and the ring road
  double ring_road = 1;            // probability that an avenue runs around the town
  double motorway = 0;             // probability that a motorway runs around the town
  double slip_lanes = 0.1;         // fraction of slip lanes among right turns at lights, if the streets are long enough
  double lane_spread_m = 0;        // maximum deviation of the width of the town's lanes from 3.5 m
  double hills_m = 6;              // maximum height difference, before grades are limited
  double overpasses = 0.1;         // fraction of overpasses among the inner crossings with four arms
  double crosswalks = 0.9;         // fraction of the crossings that have crosswalks
  double sidewalks = 0.95;         // fraction of the streets that have sidewalks
  double parking = 0.4;            // fraction of sides with parking bays, among the sides of single-lane streets
  double lights = 0.8;             // fraction of the crossings (except roundabouts) that have lights
  double far_side = 0.5;  // fraction of crossings whose light heads are beyond the junction, among those with lights
};

/// A numeric option of towns: its name in commands and map names, its range [low, high] and its help text.
struct TownFeature {
  const char* name;
  double TownOptions::* value;
  double low, high;
  const char* help;
  bool is_whole = false;
};

const std::vector<TownFeature>& town_features();
constexpr int kMaxTownBlocks = 32;

/// Throws UsageError, which names the option, its range and its value, if an option is out of range.
void check_town_options(const TownOptions& options);

/// A family of towns with the same default options. The names of their maps begin with the family's name.
struct TownFamily {
  const char* name;
  TownOptions defaults;
};

/// Returns the families: `procedural` (small towns) and `city` (with two-lane roundabouts, a motorway, and parking on
/// both sides).
const std::vector<TownFamily>& town_families();

/// Returns the family of a map named `FAMILY` or `FAMILY:...`, or nullptr for names of other maps.
const TownFamily* town_family_of(std::string_view map_name);

/// Parses `FAMILY[:SEED[:NAME=VALUE,...]]`, where NAME is `blocks` (as AxB) or a feature's name. Returns nothing for
/// names of other maps. Throws UsageError for invalid options.
std::optional<TownOptions> parse_town_name(std::string_view map_name);

}  // namespace pictura
