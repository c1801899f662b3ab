#include "pictura/drawing/evaluation_plot.h"

#include <algorithm>
#include <limits>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/json.h"

namespace pictura {
namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();

struct Metric {
  const char *name, *title, *y_label;
  bool is_optional = false;  // without a panel where no row has it
};
// As the columns of the paper's tables.
constexpr Metric kMetrics[] = {{"at_fault_collision_rate", "At-fault collision", "share of vehicles"},
                               {"off_road_rate", "Off-road", "share of vehicles"},
                               {"red_light_rate", "Red light", "share of vehicles"},
                               {"goals_per_vehicle", "Goals", "a vehicle"},
                               {"km_per_infraction", "Distance per infraction", "km", true},
                               {"km_per_at_fault_infraction", "Distance per at-fault infraction", "km", true}};

/// Returns NaN for null, where there is nothing to divide by, and for optional metrics that the row lacks.
double number_of(const Json& row, const Metric& metric) {
  if (metric.is_optional && !row.contains(metric.name)) return kNoValue;
  const Json& value = row.at(metric.name);
  return value.is_null() ? kNoValue : value.get<double>();
}

/// Adds one evaluation to a line of one metric.
void add_point(const Json& point, RunAxis axis, const Metric& metric, PlotSeries* series_inout) {
  double medium = kNoValue, low = kNoValue, high = kNoValue;
  for (const Json& row : point.at("rows")) {
    const double value = number_of(row, metric);
    if (row.at("density") == "medium") medium = value;
    low = std::fmin(low, value);  // of a number and NaN the number
    high = std::fmax(high, value);
  }
  series_inout->x.push_back(point.at(axis == RunAxis::hours ? "gpu_hours" : "agent_steps").get<double>());
  series_inout->y.push_back(medium);
  series_inout->low.push_back(low);
  series_inout->high.push_back(high);
}

bool has_medium(const Json& point) {
  const Json& rows = point.at("rows");
  return std::any_of(rows.begin(), rows.end(), [](const Json& row) { return row.at("density") == "medium"; });
}

bool has_metric(const Json& lines, const Metric& metric) {
  for (const Json& line : lines) {
    for (const Json& point : line.at("points")) {
      for (const Json& row : point.at("rows")) {
        if (row.contains(metric.name)) return true;
      }
    }
  }
  return false;
}

}  // namespace

std::vector<PlotPanel> plot_evaluations(const std::string& path, RunAxis axis) {
  std::vector<PlotPanel> panels;
  for (const Metric& metric : kMetrics) {
    panels.push_back({.title = metric.title,
                      .x_label = axis == RunAxis::hours ? "hours of one GPU" : "agent-steps",
                      .y_label = metric.y_label,
                      .series = {}});
  }
  std::string where = "its lines";
  try {
    const Json lines = parse_json(read_file(path)).at("lines");
    PICTURA_CHECK(lines.is_array() && !lines.empty(), "{}: expected a line or more", path);
    for (const Json& line : lines) {
      where = fmt::format("line {}", &line - &lines[0] + 1);
      const auto name = line.at("name").get<std::string>();
      where = fmt::format("line '{}'", name);
      const Json& points = line.at("points");
      PICTURA_CHECK(points.is_array() && !points.empty(), "{}: {}: expected a point or more", path, where);
      PICTURA_CHECK(std::all_of(points.begin(), points.end(), has_medium),
                    "{}: {}: expected a row of medium density in every point", path, where);
      for (size_t m = 0; m < std::size(kMetrics); ++m) {
        PlotSeries series{.name = name, .dashed = line.value("dashed", false)};
        for (const Json& point : points) add_point(point, axis, kMetrics[m], &series);
        PICTURA_CHECK(std::is_sorted(series.x.begin(), series.x.end()), "{}: {}: expected points in ascending order",
                      path, where);
        panels[m].series.push_back(std::move(series));
      }
    }
    for (size_t m = std::size(kMetrics); m-- > 0;) {
      if (kMetrics[m].is_optional && !has_metric(lines, kMetrics[m]))
        panels.erase(panels.begin() + static_cast<int>(m));
    }
  } catch (const nlohmann::json::exception& error) {
    throw Error(fmt::format("{}: {}: {}", path, where, error.what()));
  }
  return panels;
}

}  // namespace pictura
