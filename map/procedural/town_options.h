// Options, families and names of procedural towns.
#pragma once

#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"

namespace pictura {

/// Options of a town, which town_features() describes. Fractions are in [0, 1]. A fraction above 0 selects at least one
/// element.
struct TownOptions {
  uint64_t seed = 0;
  int blocks_x = 3, blocks_y = 3;  // in [1, 32] each
  double block_m = 90;
  double density = 0.9;
  double curved = 0.6;
  double five_arms = 0.2;
  double roundabouts = 0.2;
  double roundabout_lanes = 1;
  double avenues = 0.2;
  double max_lanes = 3;
  double ring_road = 1;
  double motorway = 0;
  double slip_lanes = 0.1;
  double lane_spread_m = 0;
  double hills_m = 6;
  double overpasses = 0.1;
  double crosswalks = 0.9;
  double sidewalks = 0.95;
  double parking = 0.4;
  double lights = 0.8;
  double far_side = 0.5;
};

/// A numeric option, its name in commands and map names, and its range [low, high].
struct TownFeature {
  const char* name;
  double TownOptions::* value;
  double low, high;
  const char* help;
  bool is_whole = false;
};

const std::vector<TownFeature>& town_features();
constexpr int kMaxTownBlocks = 32;

/// Throws UsageError, which names option, range and value, if an option is out of range.
void check_town_options(const TownOptions& options);

/// Default options of towns. Map names begin with the family's name.
struct TownFamily {
  const char* name;
  TownOptions defaults;
};

/// Returns `procedural` (small towns) and `city` (two-lane roundabouts, a motorway, parking on both sides).
const std::vector<TownFamily>& town_families();

/// Returns the family of `FAMILY` or `FAMILY:...`, or nullptr for other names.
const TownFamily* town_family_of(std::string_view map_name);

/// Parses `FAMILY[:SEED[:NAME=VALUE,...]]`, where NAME is `blocks` (as AxB) or a feature's name. Returns nothing for
/// other maps. Throws UsageError for invalid options.
std::optional<TownOptions> parse_town_name(std::string_view map_name);

}  // namespace pictura
