#include "pictura/evaluation/robust_protocol.h"

#include <algorithm>
#include <map>
#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/configuration/simulator_section.h"
#include "pictura/evaluation/progress.h"
#include "pictura/map/load_map.h"
#include "pictura/policy/session.h"

namespace pictura {

namespace {

bool are_known(const std::vector<std::string>& towns) {
  const std::vector<std::string> known = known_towns();
  return std::all_of(towns.begin(), towns.end(), [&known](const std::string& town) {
    return std::find(known.begin(), known.end(), town) != known.end();
  });
}

std::vector<std::string> seeds(const std::string& family) {
  std::vector<std::string> maps;
  for (int seed = 1; seed <= 6; ++seed) maps.push_back(family + ":" + std::to_string(seed));
  return maps;
}

// Properties of a driver that decide which conditions apply.
struct Abilities {
  bool sees_images = false, reads_observations = false;
};

Abilities abilities_of(const RobustOptions& options) {
  if (options.make_own_controller) return {named_rig(options).has_value(), /*reads_observations=*/true};
  if (!options.controller.empty()) return {};
  const PolicySession session(options.checkpoint, options);
  return {.sees_images = session.reads_images(), .reads_observations = true};
}

// Returns why the condition does not apply; an empty text if it applies.
std::string reason_against(const RobustCondition& condition, const Abilities& abilities) {
  if (condition.camera_severity > 0 && !abilities.sees_images) return "sees no images";
  if (condition.name == "impaired" && !abilities.reads_observations) return "reads no observations";
  if (condition.part == "carla" && !are_known(condition.maps)) return "no CARLA towns in the map folder";
  return "";
}

void check(const RobustOptions& options) {
  const DriverOptions fixed;
  const auto expect = [](bool is_fixed, const char* option) {
    if (!is_fixed) fail_usage("{}: has no effect with protocol robust, which fixes it", option);
  };
  expect(options.seed == kRobustSeed, "seed");
  expect(options.camera_severity == fixed.camera_severity, "camera_severity");
  expect(options.conditioning.empty(), "conditioning");
  expect(!options.light_cycles && !options.light_heads, "light_cycles, light_heads");
}

// Counts of several conditions. Conditions with equal maps and numbers of agents drive in the same worlds, whose counts
// are added, because estimates assume that scenarios are independent.
struct Pool {
  DensityResult worlds;
  std::map<std::pair<std::vector<std::string>, int>, size_t> first_world;  // by maps and agents
  int scenarios = 0;

  void add(const RobustRow& row) {
    const std::vector<ScenarioCounts>& counts = row.counts.scenarios;
    if (counts.empty()) return;
    scenarios += static_cast<int>(counts.size());
    const auto [place, is_new] =
        first_world.try_emplace({row.condition.maps, row.condition.agents_per_world}, worlds.scenarios.size());
    if (is_new) {
      worlds.scenarios.insert(worlds.scenarios.end(), counts.begin(), counts.end());
    } else {
      for (size_t i = 0; i < counts.size(); ++i) worlds.scenarios[place->second + i].add(counts[i]);
    }
  }
};

}  // namespace

const std::vector<RobustCondition>& robust_conditions() {
  constexpr int kAgents = 40, kAgentsOfCities = 60;
  const std::vector<std::string> grid = seeds("procedural");
  static const std::vector<RobustCondition> kConditions{
      {"towns", "grid towns", grid, kAgents, {}, 0},
      {"towns", "cities", seeds("city"), kAgentsOfCities, {}, 0},
      {"carla", "CARLA's towns", SimulatorSection().maps, kAgentsOfCities, {}, 0},
      {"others", "idm_lanes", grid, kAgents, {"idm_lanes=0.4"}, 0},
      {"others", "lane keepers", grid, kAgents, {"lane=0.4"}, 0},
      {"others", "impaired", grid, kAgents, {"blind=0.05", "phantom_braking=0.05", "inattentive=0.05"}, 0},
      {"cameras", "severity 0.5", grid, kAgents, {}, 0.5},
      {"cameras", "severity 1", grid, kAgents, {}, 1},
  };
  return kConditions;
}

EvaluateRow RobustReport::metrics(const RobustRow& row) const { return row_of(row.counts, setting.steps); }

std::vector<std::pair<std::string, EvaluateRow>> RobustReport::pooled() const {
  std::vector<std::pair<std::string, EvaluateRow>> result;
  for (const char* const part : {"towns", "others", "cameras", "all"}) {
    Pool pool;
    for (const RobustRow& row : rows) {
      const bool is_counted = part == std::string("all") ? row.condition.part != "carla" : row.condition.part == part;
      if (is_counted) pool.add(row);
    }
    if (pool.scenarios == 0) continue;
    result.emplace_back(part, row_of(pool.worlds, setting.steps)).second.scenarios = pool.scenarios;
  }
  return result;
}

RobustReport evaluate_robust(const RobustOptions& options) {
  check(options);
  const Abilities abilities = abilities_of(options);
  RobustReport report;
  for (const RobustCondition& condition : robust_conditions()) {
    report.rows.push_back({condition, {}, reason_against(condition, abilities)});
  }
  const auto applies = [](const RobustRow& row) { return row.not_driven.empty(); };
  const auto num_driven = static_cast<int>(std::count_if(report.rows.begin(), report.rows.end(), applies));
  int finished = 0;
  EvaluateOptions evaluation;
  static_cast<DriverOptions&>(evaluation) = options;
  evaluation.scenarios = options.scenarios;
  evaluation.steps = kRobustSteps;
  evaluation.light_cycles = LightCycles::independent;
  evaluation.light_heads = LightHeads::visible;  // cameras at the stop line must see them
  evaluation.densities = {Density::light};       // agents_per_world replaces its number of agents
  for (RobustRow& row : report.rows) {
    if (!applies(row)) continue;
    if (options.on_progress) evaluation.on_progress = progress_of_part(options.on_progress, finished, num_driven);
    evaluation.maps = row.condition.maps;
    evaluation.agents_per_world = row.condition.agents_per_world;
    evaluation.others = row.condition.others;
    evaluation.camera_severity = row.condition.camera_severity;
    EvaluateReport part = evaluate(evaluation);
    report.seconds += part.seconds;
    report.agent_steps += part.agent_steps;
    if (finished == 0) report.setting = part.results.setting;
    report.interrupted = part.interrupted;
    if (report.interrupted) break;
    row.counts = std::move(part.results.densities.front());
    ++finished;
  }
  return report;
}

}  // namespace pictura
