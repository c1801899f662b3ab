#include "pictura/drawing/learning_curve.h"

#include <cmath>
#include <cstdlib>
#include <map>
#include <sstream>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/drawing/plot.h"

namespace pictura {

namespace {

/// A CSV file of numbers by column name. Throws Error naming the file and line.
std::map<std::string, std::vector<double>> read_columns(const std::string& path) {
  std::istringstream lines(read_file(path));
  std::string line, cell;
  std::getline(lines, line);
  std::vector<std::string> names;
  for (std::istringstream cells(line); std::getline(cells, cell, ',');) names.push_back(cell);
  std::map<std::string, std::vector<double>> columns;
  for (int number = 2; std::getline(lines, line); ++number) {
    size_t column = 0;
    for (std::istringstream cells(line); std::getline(cells, cell, ','); ++column) {
      char* end = nullptr;
      const double value = std::strtod(cell.c_str(), &end);
      PICTURA_CHECK(column < names.size() && end != cell.c_str() && *end == '\0',
                    "{}:{}: expected {} numbers, got '{}' as number {}", path, number, names.size(), cell, column + 1);
      columns[names[column]].push_back(value);
    }
    PICTURA_CHECK(column == names.size(), "{}:{}: expected {} numbers, got {}", path, number, names.size(), column);
  }
  return columns;
}

}  // namespace

std::string draw_learning_curve(const std::string& run_folder) {
  const std::string csv = run_folder + "/progress.csv", picture = run_folder + "/learning_curve.png";
  const auto columns = read_columns(csv);
  if (columns.empty()) return "";
  auto column = [&](const std::string& name) {
    const auto found = columns.find(name);
    PICTURA_CHECK(found != columns.end(), "{}: expected a column '{}'", csv, name);
    return found->second;
  };
  auto panel = [&](const std::string& title, const std::vector<std::pair<std::string, std::string>>& series) {
    PlotPanel result{title, "agent-steps", "", {}};
    for (const auto& [label, name] : series) {
      result.series.push_back({label, column("charts/agent_steps"), column(name)});
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
