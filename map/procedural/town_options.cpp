#include "pictura/map/procedural/town_options.h"

#include <charconv>
#include <cmath>

#include <fmt/format.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

/// Removes the number at the start of `text`; false if there is none.
template <typename Number>
bool take_number(std::string_view* text, Number* number_out) {
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), *number_out);
  if (error != std::errc()) return false;
  text->remove_prefix(static_cast<std::size_t>(end - text->data()));
  return true;
}

std::string feature_names() {
  std::string names = "blocks";
  for (const TownFeature& feature : town_features()) names += fmt::format(", {}", feature.name);
  return names;
}

void set_option(std::string_view name, std::string_view value, std::string_view map_name, TownOptions* options) {
  std::string_view rest = value;
  if (name == "blocks") {
    const bool is_pair = take_number(&rest, &options->blocks_x) && rest.starts_with('x') &&
                         (rest.remove_prefix(1), take_number(&rest, &options->blocks_y)) && rest.empty();
    if (!is_pair) fail_usage("map '{}': blocks: expected AxB, as 4x3, got '{}'", map_name, value);
    return;
  }
  for (const TownFeature& feature : town_features()) {
    if (name != feature.name) continue;
    if (!take_number(&rest, &(options->*feature.value)) || !rest.empty()) {
      fail_usage("map '{}': {}: expected a number, got '{}'", map_name, name, value);
    }
    return;
  }
  fail_usage("map '{}': expected one of {}, got '{}'", map_name, feature_names(), name);
}

}  // namespace

const std::vector<TownFeature>& town_features() {
  static const std::vector<TownFeature> kFeatures = {
      {"block-m", &TownOptions::block_m, 80, 200, "Mean distance between crossings"},
      {"density", &TownOptions::density, 0, 1, "Share of the removable streets that are kept"},
      {"curved", &TownOptions::curved, 0, 1, "Share of curved streets"},
      {"five-arms", &TownOptions::five_arms, 0, 1, "Share of inner crossings with a fifth arm"},
      {"roundabouts", &TownOptions::roundabouts, 0, 1, "Share of crossings of single-lane streets"},
      {"avenues", &TownOptions::avenues, 0, 1, "Share of inner rows and columns with several lanes each way"},
      {"max-lanes", &TownOptions::max_lanes, 1, 3, "Maximum number of lanes each way of avenues and the ring road"},
      {"ring-road", &TownOptions::ring_road, 0, 1, "Chance of an avenue around the town"},
      {"slip-lanes", &TownOptions::slip_lanes, 0, 1, "Share of right turns that bypass their light"},
      {"hills-m", &TownOptions::hills_m, 0, 50, "Maximum height difference, before grades are limited"},
      {"overpasses", &TownOptions::overpasses, 0, 1, "Share of inner crossings where one street crosses over another"},
      {"crosswalks", &TownOptions::crosswalks, 0, 1, "Share of crossings with crosswalks"},
      {"sidewalks", &TownOptions::sidewalks, 0, 1, "Share of streets with sidewalks"},
      {"parking", &TownOptions::parking, 0, 1, "Share of the sides of single-lane streets with parking bays"},
      {"lights", &TownOptions::lights, 0, 1, "Share of crossings with traffic lights"},
      {"far-side", &TownOptions::far_side, 0, 1,
       "Share of the crossings with lights whose heads are beyond the junction"},
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
  }
  if (options.max_lanes != std::floor(options.max_lanes)) {
    fail_usage("procedural town: max-lanes: expected a whole number, got {}", options.max_lanes);
  }
}

TownOptions parse_town_options(std::string_view text, std::string_view map_name) {
  TownOptions options;
  std::string_view rest = text;
  if (!take_number(&rest, &options.seed) || !(rest.empty() || rest.starts_with(':'))) {
    fail_usage("map '{}': expected procedural or procedural:SEED with an integer from 0, got '{}'", map_name, text);
  }
  while (!rest.empty()) {
    rest.remove_prefix(1);
    const std::string_view pair = rest.substr(0, rest.find(','));
    const std::size_t equals = pair.find('=');
    if (equals == std::string_view::npos) {
      fail_usage("map '{}': expected NAME=VALUE, got '{}'; names are {}", map_name, pair, feature_names());
    }
    set_option(pair.substr(0, equals), pair.substr(equals + 1), map_name, &options);
    rest.remove_prefix(pair.size());
  }
  check_town_options(options);
  return options;
}

}  // namespace pictura
