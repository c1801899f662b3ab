#include "pictura/evaluation/results.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/json_text.h"
#include "pictura/evaluation/results_json.h"

namespace pictura {

namespace {

constexpr const char* kResultsFormat = "pictura evaluation 2";
constexpr const char* kResultsFormatAtFaultAlone = "pictura evaluation 1";
// Counts that format 1 lacks. The count "infractions" of format 1 is at_fault_infraction.
constexpr const char* kCountsOfFormat2[] = {"collision", "wall_contact", "any_infraction", "at_fault_infraction"};
// Counts that files of format 2 may lack.
constexpr const char* kLaterCounts[] = {"asked",        "spawned",         "entered",   "left",
                                        "driven_steps", "reversing_steps", "red_waits", "red_wait_moved_m",
                                        "stuck_at_end", "never_moved"};

constexpr Estimate kUnknown{std::numeric_limits<double>::quiet_NaN(), std::numeric_limits<double>::quiet_NaN()};

// Returns a scenario's counts in format 1.
Json as_format_1(Json json) {
  json["infractions"] = json.at("at_fault_infraction");
  for (const char* name : kCountsOfFormat2) json.erase(name);
  for (const char* name : kLaterCounts) json.erase(name);
  return json;
}

// Converts a scenario's counts of format 1 to the keys of format 2; 0 for missing counts.
Json from_format_1(Json json) {
  for (const char* name : kCountsOfFormat2) json[name] = 0;
  json["at_fault_infraction"] = json.at("infractions");
  return json;
}

ScenarioCounts scenario_counts_from(Json json) {
  for (const char* name : kLaterCounts) json.emplace(name, 0);
  return counts_from<ScenarioCounts>(json);
}

struct Part {
  const DensityResult* result;
  const std::string* name;
};

// Merges the parts of one density.
DensityResult joined(std::vector<Part> parts) {
  std::sort(parts.begin(), parts.end(),
            [](const Part& a, const Part& b) { return a.result->first_scenario < b.result->first_scenario; });
  DensityResult all = *parts[0].result;
  for (size_t i = 1; i < parts.size(); ++i) {
    const DensityResult& next = *parts[i].result;
    const auto end = all.first_scenario + static_cast<int>(all.scenarios.size());
    PICTURA_CHECK(next.agents_per_world == all.agents_per_world, "{}: {}: has {} agents per world, {} has {}",
                  *parts[i].name, next.density, next.agents_per_world, *parts[0].name, all.agents_per_world);
    PICTURA_CHECK(next.first_scenario == end,
                  "{}: {}: begins with scenario {}: expected {}, the next after those of {}", *parts[i].name,
                  next.density, next.first_scenario, end, *parts[i - 1].name);
    all.scenarios.insert(all.scenarios.end(), next.scenarios.begin(), next.scenarios.end());
  }
  return all;
}

}  // namespace

Estimate estimate_ratio(const std::vector<RatioTerm>& scenarios) {
  double part = 0, whole = 0;
  for (const RatioTerm& scenario : scenarios) {
    part += scenario.part;
    whole += scenario.whole;
  }
  constexpr double kInfinity = std::numeric_limits<double>::infinity();
  if (whole == 0) return {kInfinity, kInfinity};
  const double value = part / whole;
  double squares = 0;
  for (const RatioTerm& scenario : scenarios) {
    const double residual = scenario.part - value * scenario.whole;
    squares += residual * residual;
  }
  const auto n = static_cast<double>(scenarios.size());
  if (n < 2) return {value, kInfinity};
  return {value, 1.96 * std::sqrt(n / (n - 1) * squares) / whole};
}

EvaluateRow row_of(const DensityResult& result, int steps) {
  using Counts = ScenarioCounts;
  const std::vector<Counts>& all = result.scenarios;
  const auto per_vehicle = [&all](const auto& part_of) {
    return estimate_ratio(all, part_of, [](const Counts& c) { return c.vehicles; });
  };
  const auto km_of = [](const Counts& c) { return c.distance_m / 1000; };

  EvaluateRow row;
  row.density = result.density;
  row.driver = result.driver;
  row.scenarios = static_cast<int>(all.size());
  row.steps = steps;
  int64_t driven_steps = 0;
  for (const Counts& counts : all) {
    row.vehicle_episodes += counts.vehicles;
    row.infractions += counts.any_infraction;
    row.km_driven += km_of(counts);
    row.asked += counts.asked;
    row.spawned += counts.spawned;
    row.entered += counts.entered;
    row.left += counts.left;
    row.red_waits += counts.standing.red_waits;
    driven_steps += counts.standing.driven_steps;
  }
  row.at_fault_collision_rate = per_vehicle([](const Counts& c) { return c.at_fault; });
  row.off_road_rate = per_vehicle([](const Counts& c) { return c.off_road; });
  row.red_light_rate = per_vehicle([](const Counts& c) { return c.red_light; });
  row.goals_per_vehicle = per_vehicle([](const Counts& c) { return c.goals; });
  row.km_per_infraction = estimate_ratio(all, km_of, [](const Counts& c) { return c.any_infraction; });
  row.km_per_vehicle = per_vehicle(km_of);
  row.waypoints_per_vehicle = per_vehicle([](const Counts& c) { return c.waypoints; });
  row.return_per_vehicle = per_vehicle([](const Counts& c) { return c.returns; });
  row.active_at_end_share = per_vehicle([](const Counts& c) { return c.active_at_end; });
  row.never_moved_share = per_vehicle([](const Counts& c) { return c.never_moved; });
  row.collision_rate = per_vehicle([](const Counts& c) { return c.collision; });
  row.wall_contact_rate = per_vehicle([](const Counts& c) { return c.wall_contact; });
  row.km_per_at_fault_infraction = estimate_ratio(all, km_of, [](const Counts& c) { return c.at_fault_infraction; });
  const auto per_km = [&](const auto& part_of) { return estimate_ratio(all, part_of, km_of); };
  row.at_fault_collisions_per_km = per_km([](const Counts& c) { return c.at_fault; });
  row.off_road_per_km = per_km([](const Counts& c) { return c.off_road; });
  row.red_lights_per_km = per_km([](const Counts& c) { return c.red_light; });
  row.goals_per_km = per_km([](const Counts& c) { return c.goals; });

  row.reversing_share = row.red_wait_moved_m = row.stuck_at_end_share = kUnknown;
  if (driven_steps > 0) {
    row.reversing_share = estimate_ratio(
        all, [](const Counts& c) { return c.standing.reversing_steps; },
        [](const Counts& c) { return c.standing.driven_steps; });
    row.stuck_at_end_share = per_vehicle([](const Counts& c) { return c.standing.stuck_at_end; });
  }
  if (row.red_waits > 0) {
    row.red_wait_moved_m = estimate_ratio(
        all, [](const Counts& c) { return c.standing.red_wait_moved_m; },
        [](const Counts& c) { return c.standing.red_waits; });
  }
  return row;
}

std::vector<EvaluateRow> rows_of(const EvaluationResults& results) {
  std::vector<EvaluateRow> rows;
  for (const DensityResult& density : results.densities) {
    EvaluateRow& row = rows.emplace_back(row_of(density, results.setting.steps));
    if (results.counts_all_collisions) continue;
    row.collision_rate = row.wall_contact_rate = row.km_per_infraction = row.never_moved_share = kUnknown;
  }
  return rows;
}

std::vector<std::pair<std::string, Estimate>> metrics_of(const EvaluateRow& row) {
  return {{"at_fault_collision_rate", row.at_fault_collision_rate},
          {"off_road_rate", row.off_road_rate},
          {"red_light_rate", row.red_light_rate},
          {"goals_per_vehicle", row.goals_per_vehicle},
          {"km_per_infraction", row.km_per_infraction},
          {"km_per_vehicle", row.km_per_vehicle},
          {"waypoints_per_vehicle", row.waypoints_per_vehicle},
          {"return_per_vehicle", row.return_per_vehicle},
          {"active_at_end_share", row.active_at_end_share},
          {"never_moved_share", row.never_moved_share},
          {"collision_rate", row.collision_rate},
          {"wall_contact_rate", row.wall_contact_rate},
          {"km_per_at_fault_infraction", row.km_per_at_fault_infraction},
          {"reversing_share", row.reversing_share},
          {"red_wait_moved_m", row.red_wait_moved_m},
          {"stuck_at_end_share", row.stuck_at_end_share}};
}

std::vector<std::pair<std::string, Estimate>> rates_per_km_of(const EvaluateRow& row) {
  return {{"at_fault_collisions_per_km", row.at_fault_collisions_per_km},
          {"off_road_per_km", row.off_road_per_km},
          {"red_lights_per_km", row.red_lights_per_km},
          {"goals_per_km", row.goals_per_km}};
}

EvaluationResults merge(const std::vector<EvaluationResults>& parts, const std::vector<std::string>& names) {
  PICTURA_CHECK(!parts.empty(), "merge: expected one part or more");
  using Key = std::pair<std::string, std::string>;  // density and driver
  std::vector<Key> order;
  std::map<Key, std::vector<Part>> by_key;
  EvaluationResults all{parts[0].setting};
  for (size_t i = 0; i < parts.size(); ++i) {
    check_same(to_json(parts[0].setting), names[0], to_json(parts[i].setting), names[i]);
    all.counts_all_collisions &= parts[i].counts_all_collisions;
    for (const DensityResult& density : parts[i].densities) {
      const Key key{density.density, density.driver};
      if (!by_key.contains(key)) order.push_back(key);
      by_key[key].push_back({&density, &names[i]});
    }
  }
  for (const Key& key : order) all.densities.push_back(joined(by_key[key]));
  return all;
}

void write_results(const std::string& path, const EvaluationResults& results) {
  Json densities = Json::array();
  for (const DensityResult& density : results.densities) {
    Json scenarios = Json::array();
    for (const ScenarioCounts& counts : density.scenarios) {
      scenarios.push_back(results.counts_all_collisions ? counts_json(counts) : as_format_1(counts_json(counts)));
    }
    densities.push_back({{"density", density.density},
                         {"driver", density.driver},
                         {"agents_per_world", density.agents_per_world},
                         {"first_scenario", density.first_scenario},
                         {"scenarios", scenarios}});
  }
  const Json json = {{"format", results.counts_all_collisions ? kResultsFormat : kResultsFormatAtFaultAlone},
                     {"setting", to_json(results.setting)},
                     {"densities", densities}};
  write_file(path, json_text(json, 1) + "\n");
}

EvaluationResults read_results(const std::string& path) {
  const Json json = read_results_json(path, {kResultsFormat, kResultsFormatAtFaultAlone});
  EvaluationResults results;
  results.counts_all_collisions = json.at("format") == kResultsFormat;
  parse_results(path, [&] {
    results.setting = setting_from(json.at("setting"));
    for (const Json& density : json.at("densities")) {
      DensityResult result;
      density.at("density").get_to(result.density);
      result.driver = density.value("driver", "");  // absent in files of earlier versions
      density.at("agents_per_world").get_to(result.agents_per_world);
      density.at("first_scenario").get_to(result.first_scenario);
      for (const Json& counts : density.at("scenarios")) {
        result.scenarios.push_back(
            scenario_counts_from(results.counts_all_collisions ? counts : from_format_1(counts)));
      }
      results.densities.push_back(std::move(result));
    }
  });
  return results;
}

}  // namespace pictura
