#include "pictura/evaluation/scene_results.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/json_text.h"
#include "pictura/evaluation/csv.h"
#include "pictura/evaluation/results_json.h"
#include "pictura/simulator/fields.h"

namespace pictura {

namespace {

constexpr const char* kSceneResultsFormat = "pictura evaluation in scenes 1";

Json to_json(const SceneProtocol& protocol) {
  Json json{{"name", protocol.name},
            {"control", protocol.control},
            {"start_step", protocol.start_step},
            {"steps", protocol.steps},
            {"densities", protocol.densities}};
  for (const auto& [name, value] : rules_of(protocol)) json["rules"][name] = value;
  return json;
}

SceneProtocol protocol_from(const Json& json) {
  SceneProtocol protocol;
  json.at("name").get_to(protocol.name);
  json.at("control").get_to(protocol.control);
  json.at("start_step").get_to(protocol.start_step);
  json.at("steps").get_to(protocol.steps);
  json.at("densities").get_to(protocol.densities);
  for (const SceneRule& rule : scene_rules()) {
    set_scene_rule(fmt::format("{}={}", rule.name, json.at("rules").at(rule.name).get<std::string>()), &protocol);
  }
  return protocol;
}

}  // namespace

int64_t SceneResults::agent_steps() const {
  int64_t steps = 0;
  for (const std::vector<SceneCounts>& density : counts) {
    for (const SceneCounts& scene : density) steps += scene.driven_steps;
  }
  return steps;
}

void add(const SceneAgent& agent, bool is_vehicle, SceneCounts* counts_inout) {
  counts_inout->driven_steps += agent.driven_steps;
  if (!is_vehicle) return;
  ++counts_inout->vehicles;
  counts_inout->at_fault += (agent.events & kEventAtFault) != 0;
  counts_inout->collision += (agent.events & kEventCollision) != 0;
  counts_inout->off_road += (agent.events & kEventOffRoad) != 0;
  counts_inout->infractions += (agent.events & (kEventAtFault | kEventOffRoad)) != 0;
  counts_inout->goals += agent.arrived;
  counts_inout->distance_m += static_cast<double>(agent.distance_m);
  if (std::isnan(agent.mean_displacement_m)) return;
  ++counts_inout->measured;
  counts_inout->displacement_m += static_cast<double>(agent.mean_displacement_m);
}

SceneRow row_of(double density, const std::vector<SceneCounts>& scenes) {
  using Counts = SceneCounts;
  const auto per_vehicle = [&scenes](const auto& part_of) {
    return estimate_ratio(scenes, part_of, [](const Counts& c) { return c.vehicles; });
  };
  SceneRow row;
  row.density = density;
  row.scenes = static_cast<int>(scenes.size());
  for (const Counts& counts : scenes) {
    row.vehicle_episodes += counts.vehicles;
    row.km_driven += counts.distance_m / 1000;
  }
  row.at_fault_collision_rate = per_vehicle([](const Counts& c) { return c.at_fault; });
  row.off_road_rate = per_vehicle([](const Counts& c) { return c.off_road; });
  row.goal_rate = per_vehicle([](const Counts& c) { return c.goals; });
  row.collision_rate = per_vehicle([](const Counts& c) { return c.collision; });
  row.mean_displacement_m = estimate_ratio(
      scenes, [](const Counts& c) { return c.displacement_m; }, [](const Counts& c) { return c.measured; });
  return row;
}

std::vector<SceneRow> rows_of(const SceneResults& results) {
  std::vector<SceneRow> rows;
  for (size_t i = 0; i < results.counts.size() && results.scored() > 0; ++i) {
    rows.push_back(row_of(results.protocol.densities[i], results.counts[i]));
  }
  return rows;
}

std::vector<std::pair<std::string, Estimate>> metrics_of(const SceneRow& row) {
  return {{"at_fault_collision_rate", row.at_fault_collision_rate},
          {"off_road_rate", row.off_road_rate},
          {"goal_rate", row.goal_rate},
          {"collision_rate", row.collision_rate},
          {"mean_displacement_m", row.mean_displacement_m}};
}

SceneResults merge(const std::vector<SceneResults>& parts, const std::vector<std::string>& names) {
  PICTURA_CHECK(!parts.empty(), "merge: expected one part or more");
  std::vector<size_t> order(parts.size());
  std::iota(order.begin(), order.end(), size_t{0});
  std::stable_sort(order.begin(), order.end(),
                   [&parts](size_t a, size_t b) { return parts[a].first_scene < parts[b].first_scene; });
  SceneResults all = parts[order[0]];
  for (size_t i = 1; i < order.size(); ++i) {
    const SceneResults& part = parts[order[i]];
    const std::string &name = names[order[i]], &first_name = names[order[0]];
    check_same(to_json(all.setting), first_name, to_json(part.setting), name);
    check_same(to_json(all.protocol), first_name, to_json(part.protocol), name);
    check_same(Json::object({{"unread", all.unread}}), first_name, Json::object({{"unread", part.unread}}), name);
    PICTURA_CHECK(part.first_scene == all.first_scene + all.num_scenes,
                  "{}: begins with scene {}: expected {}, the next after those of {}", name, part.first_scene,
                  all.first_scene + all.num_scenes, names[order[i - 1]]);
    all.num_scenes += part.num_scenes;
    all.without_drivers += part.without_drivers;
    all.repaired_headings += part.repaired_headings;
    all.faults.insert(all.faults.end(), part.faults.begin(), part.faults.end());
    for (size_t d = 0; d < all.counts.size(); ++d) {
      all.counts[d].insert(all.counts[d].end(), part.counts[d].begin(), part.counts[d].end());
    }
  }
  return all;
}

void write_results(const std::string& path, const SceneResults& results) {
  Json counts = Json::array();
  for (const std::vector<SceneCounts>& density : results.counts) {
    Json& scenes = counts.emplace_back(Json::array());
    for (const SceneCounts& scene : density) scenes.push_back(counts_json(scene));
  }
  const Json json = {{"format", kSceneResultsFormat},
                     {"setting", to_json(results.setting)},
                     {"protocol", to_json(results.protocol)},
                     {"unread", results.unread},
                     {"first_scene", results.first_scene},
                     {"num_scenes", results.num_scenes},
                     {"without_drivers", results.without_drivers},
                     {"repaired_headings", results.repaired_headings},
                     {"faults", results.faults},
                     {"counts", counts}};
  write_file(path, json_text(json, 1) + "\n");
}

SceneResults read_scene_results(const std::string& path) {
  const Json json = read_results_json(path, {kSceneResultsFormat});
  SceneResults results;
  parse_results(path, [&] {
    results.setting = setting_from(json.at("setting"));
    results.protocol = protocol_from(json.at("protocol"));
    json.at("unread").get_to(results.unread);
    json.at("first_scene").get_to(results.first_scene);
    json.at("num_scenes").get_to(results.num_scenes);
    json.at("without_drivers").get_to(results.without_drivers);
    results.repaired_headings = json.value("repaired_headings", 0);  // absent in files of earlier versions
    json.at("faults").get_to(results.faults);
    for (const Json& density : json.at("counts")) {
      std::vector<SceneCounts>& scenes = results.counts.emplace_back();
      for (const Json& scene : density) scenes.push_back(counts_from<SceneCounts>(scene));
    }
    const size_t num_densities = results.protocol.densities.size();
    PICTURA_CHECK(results.counts.size() == num_densities, "counts: expected {} densities, got {}", num_densities,
                  results.counts.size());
    for (const std::vector<SceneCounts>& density : results.counts) {
      PICTURA_CHECK(density.size() == results.counts[0].size(), "counts: expected {} scenes of each density, got {}",
                    results.counts[0].size(), density.size());
    }
  });
  return results;
}

bool has_scene_results(const std::string& path) {
  const Json json = parse_json(read_file(path), /*allow_exceptions=*/false);
  return json.is_object() && json.value("format", Json()) == kSceneResultsFormat;
}

std::string scene_agents_csv_head() {
  return "scenario_id,density,rollout,track_id,type,takeover_step,driven_steps,arrived,collision,at_fault,off_road,"
         "distance_m,"
         "mean_displacement_m,final_displacement_m\n";
}

std::string csv_line(const SceneAgent& agent) {
  const auto has = [&agent](Event event) { return (agent.events & event) != 0 ? 1 : 0; };
  const auto metres = [](float value) { return std::isnan(value) ? std::string() : fmt::format("{:.6g}", value); };
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_quoted(agent.scenario_id), agent.density,
                     agent.rollout, agent.track_id, to_string(agent.type), agent.takeover_step, agent.driven_steps,
                     agent.arrived ? 1 : 0, has(kEventCollision), has(kEventAtFault), has(kEventOffRoad),
                     metres(agent.distance_m), metres(agent.mean_displacement_m), metres(agent.final_displacement_m));
}

}  // namespace pictura
