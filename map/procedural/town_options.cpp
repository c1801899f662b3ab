#include "pictura/map/procedural/town_options.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/suggestion.h"

namespace pictura {

namespace {

std::vector<std::string> option_names() {
  std::vector<std::string> names{"blocks"};
  for (const TownFeature& feature : town_features()) names.emplace_back(feature.name);
  return names;
}

int take_blocks(std::string_view count, std::string_view value, std::string_view map_name) {
  const std::optional<uint64_t> number = parse_unsigned(count);
  if (!number || *number < 1 || *number > uint64_t{kMaxTownBlocks}) {
    fail_usage("map '{}': blocks: expected AxB, for instance 4x3, with 1 to {} each, got '{}'", map_name,
               kMaxTownBlocks, value);
  }
  return static_cast<int>(*number);
}

void set_option(std::string_view name, std::string_view value, std::string_view map_name, TownOptions* options) {
  if (name == "blocks") {
    const std::size_t cross = std::min(value.find('x'), value.size());
    options->blocks_x = take_blocks(value.substr(0, cross), value, map_name);
    options->blocks_y = take_blocks(value.substr(std::min(cross + 1, value.size())), value, map_name);
    return;
  }
  for (const TownFeature& feature : town_features()) {
    if (name != feature.name) continue;
    const std::optional<double> number = parse_number(value);
    if (!number) {
      fail_usage("map '{}': {}: expected a number of {} to {}, got '{}'", map_name, name, feature.low, feature.high,
                 value);
    }
    options->*feature.value = *number;
    return;
  }
  fail_usage("map '{}': unknown option '{}'; expected one of {}{}", map_name, name, fmt::join(option_names(), ", "),
             suggestion(name, option_names()));
}

}  // namespace

const std::vector<TownFeature>& town_features() {
  static const std::vector<TownFeature> kFeatures = {
      {"block-m", &TownOptions::block_m, 80, 200, "Mean distance between crossings in m"},
      {"density", &TownOptions::density, 0, 1, "Share of streets that are kept, among streets that may be removed"},
      {"curved", &TownOptions::curved, 0, 1, "Share of curved streets"},
      {"five-arms", &TownOptions::five_arms, 0, 1, "Share of inner crossings with a fifth arm"},
      {"roundabouts", &TownOptions::roundabouts, 0, 1, "Share of roundabouts among crossings with narrow streets"},
      {"roundabout-lanes", &TownOptions::roundabout_lanes, 1, 2,
       "Maximum number of lanes of roundabouts, and per direction of their streets", true},
      {"avenues", &TownOptions::avenues, 0, 1,
       "Share of inner rows and columns of streets with several lanes per direction"},
      {"max-lanes", &TownOptions::max_lanes, 1, 3, "Maximum number of lanes per direction of avenues and the ring road",
       true},
      {"ring-road", &TownOptions::ring_road, 0, 1, "Probability of an avenue around the town"},
      {"motorway", &TownOptions::motorway, 0, 1, "Probability of a motorway around the town, with two interchanges"},
      {"slip-lanes", &TownOptions::slip_lanes, 0, 1, "Share of right turns that bypass their light"},
      {"lane-spread-m", &TownOptions::lane_spread_m, 0, 0.4,
       "Maximum deviation of the lane width from 3.5 m, equal for all lanes of a town"},
      {"hills-m", &TownOptions::hills_m, 0, 50, "Maximum height difference in m, before grades are limited"},
      {"overpasses", &TownOptions::overpasses, 0, 1, "Share of inner crossings with an overpass"},
      {"crosswalks", &TownOptions::crosswalks, 0, 1, "Share of crossings with crosswalks"},
      {"sidewalks", &TownOptions::sidewalks, 0, 1, "Share of streets with sidewalks"},
      {"parking", &TownOptions::parking, 0, 1, "Share of the sides of single-lane streets with parking bays"},
      {"lights", &TownOptions::lights, 0, 1, "Share of crossings with traffic lights"},
      {"far-side", &TownOptions::far_side, 0, 1,
       "Share of crossings with light heads beyond the junction, among crossings with lights"},
  };
  return kFeatures;
}

void check_town_options(const TownOptions& options) {
  const int blocks[2] = {options.blocks_x, options.blocks_y};
  for (const int count : blocks) {
    if (count < 1 || count > kMaxTownBlocks) {
      fail_usage("procedural town: blocks: expected 1 to {} each way, got {} x {}", kMaxTownBlocks, blocks[0],
                 blocks[1]);
    }
  }
  for (const TownFeature& feature : town_features()) {
    const double value = options.*feature.value;
    if (!(value >= feature.low && value <= feature.high)) {
      fail_usage("procedural town: {}: expected {} to {}, got {}", feature.name, feature.low, feature.high, value);
    }
    if (feature.is_whole && value != std::floor(value)) {
      fail_usage("procedural town: {}: expected a whole number, got {}", feature.name, value);
    }
  }
}

const std::vector<TownFamily>& town_families() {
  static const std::vector<TownFamily> kFamilies = {
      {"procedural", {}},
      {"city",
       {.blocks_x = 4,
        .block_m = 110,
        .curved = 0.5,
        .five_arms = 0.1,
        .roundabouts = 0.25,
        .roundabout_lanes = 2,
        .avenues = 0.3,
        .ring_road = 0.4,
        .motorway = 1,
        .slip_lanes = 0.25,
        .lane_spread_m = 0.4,
        .hills_m = 12,
        .parking = 0.85,
        .far_side = 0.65}},
  };
  return kFamilies;
}

const TownFamily* town_family_of(std::string_view map_name) {
  const std::string_view first_word = map_name.substr(0, map_name.find(':'));
  for (const TownFamily& family : town_families()) {
    if (first_word == family.name) return &family;
  }
  return nullptr;
}

std::optional<TownOptions> parse_town_name(std::string_view map_name) {
  const TownFamily* family = town_family_of(map_name);
  if (!family) return std::nullopt;
  TownOptions options = family->defaults;
  if (map_name == family->name) return options;
  const std::string_view text = map_name.substr(map_name.find(':') + 1);
  const std::size_t colon = std::min(text.find(':'), text.size());
  const std::optional<uint64_t> seed = parse_unsigned(text.substr(0, colon));
  if (!seed) {
    fail_usage("map '{}': expected {} or {}:SEED with an integer of 0 to {}, got '{}'", map_name, family->name,
               family->name, std::numeric_limits<uint64_t>::max(), text);
  }
  options.seed = *seed;
  std::vector<std::string_view> given;
  for (std::string_view rest = text.substr(colon); !rest.empty();) {
    rest.remove_prefix(1);
    const std::string_view pair = rest.substr(0, rest.find(','));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos) {
      fail_usage("map '{}': expected NAME=VALUE, got '{}'; names are {}", map_name, pair,
                 fmt::join(option_names(), ", "));
    }
    const std::string_view name = pair.substr(0, equals);
    if (std::find(given.begin(), given.end(), name) != given.end()) {
      fail_usage("map '{}': {}: given twice", map_name, name);
    }
    given.push_back(name);
    set_option(name, pair.substr(equals + 1), map_name, &options);
    rest.remove_prefix(pair.size());
  }
  check_town_options(options);
  return options;
}

}  // namespace pictura
