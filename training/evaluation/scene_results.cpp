#include "pictura/training/evaluation/scene_results.h"

#include <cmath>

#include "pictura/common/error.h"
#include "pictura/simulator/fields.h"
#include "pictura/training/evaluation/csv.h"

namespace pictura {

namespace {

template <typename Part, typename Whole>
Estimate ratio(const std::vector<SceneCounts>& scenes, const Part& part_of, const Whole& whole_of) {
  std::vector<RatioTerm> terms;
  for (const SceneCounts& scene : scenes) {
    terms.push_back({static_cast<double>(part_of(scene)), static_cast<double>(whole_of(scene))});
  }
  return estimate_ratio(terms);
}

}  // namespace

void add(const SceneAgent& agent, bool is_vehicle, SceneCounts* counts_inout) {
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
    return ratio(scenes, part_of, [](const Counts& c) { return c.vehicles; });
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
  row.mean_displacement_m =
      ratio(scenes, [](const Counts& c) { return c.displacement_m; }, [](const Counts& c) { return c.measured; });
  return row;
}

std::vector<std::pair<std::string, Estimate>> metrics_of(const SceneRow& row) {
  return {{"at_fault_collision_rate", row.at_fault_collision_rate},
          {"off_road_rate", row.off_road_rate},
          {"goal_rate", row.goal_rate},
          {"collision_rate", row.collision_rate},
          {"mean_displacement_m", row.mean_displacement_m}};
}

std::string scene_agents_csv_head() {
  return "scenario_id,density,track_id,type,takeover_step,driven_steps,arrived,collision,at_fault,off_road,distance_m,"
         "mean_displacement_m,final_displacement_m\n";
}

std::string csv_line(const SceneAgent& agent) {
  const auto has = [&agent](Event event) { return (agent.events & event) != 0 ? 1 : 0; };
  const auto metres = [](float value) { return std::isnan(value) ? std::string() : fmt::format("{:.6g}", value); };
  return fmt::format("{},{},{},{},{},{},{},{},{},{},{},{},{}\n", csv_quoted(agent.scenario_id), agent.density,
                     agent.track_id, to_string(agent.type), agent.takeover_step, agent.driven_steps,
                     agent.arrived ? 1 : 0, has(kEventCollision), has(kEventAtFault), has(kEventOffRoad),
                     metres(agent.distance_m), metres(agent.mean_displacement_m), metres(agent.final_displacement_m));
}

}  // namespace pictura
