#include "pictura/drawing/learning_curve.h"

#include "pictura/drawing/plot.h"
#include "pictura/drawing/progress_table.h"

namespace pictura {

std::string draw_learning_curve(const std::string& run_folder) {
  const ProgressTable progress(run_folder);
  if (progress.num_rows() == 0) return "";
  const std::string picture = run_folder + "/learning_curve.png";
  auto panel = [&](const std::string& title, const std::vector<std::pair<std::string, std::string>>& series) {
    PlotPanel result{title, "agent-steps", "", {}};
    for (const auto& [label, name] : series) {
      result.series.push_back({label, progress.column("charts/agent_steps"), progress.column(name)});
    }
    return result;
  };
  draw_plots_png(
      {panel("Return of an agent's episode", {{"return", "charts/episode_return"}}),
       panel("Goals per km driven", {{"goals", "driving/goals_per_km"}, {"waypoints", "driving/waypoints_per_km"}}),
       panel("Infractions per km driven", {{"at-fault collisions", "driving/at_fault_collisions_per_km"},
                                           {"off-road", "driving/off_road_per_km"},
                                           {"red light", "driving/red_light_per_km"}}),
       panel("Mean speed in m/s, entropy in nats",
             {{"speed", "driving/mean_speed_mps"}, {"entropy", "losses/entropy"}})},
      picture);
  return picture;
}

}  // namespace pictura
