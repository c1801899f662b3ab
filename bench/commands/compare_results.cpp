#include "pictura/bench/commands/compare_results.h"

#include <algorithm>
#include <array>

#include <fmt/format.h>

#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/json.h"

namespace pictura {

namespace {

/// Direction of improvement of a unit: 1 if greater is better, -1 if smaller is better, 0 if neither is better.
int direction_of(const std::string& unit) {
  if (unit.ends_with("_per_s")) return 1;
  return unit == "s" || unit == "ms" || unit == "GB" || unit == "GiB" ? -1 : 0;
}

const char* name_of(Change change) {
  switch (change) {
    case Change::better: return "better";
    case Change::worse: return "worse";
    case Change::within_spread: return "within the spread";
    case Change::undirected: break;
  }
  return "";
}

bool is_row(const Json& row) {
  if (!row.is_object() || !row.value("name", Json()).is_string() || !row.value("unit", Json()).is_string())
    return false;
  return std::ranges::all_of(std::array{"value", "min", "max"},
                             [&row](const char* key) { return row.value(key, Json()).is_number(); });
}

/// Formats counts by kind, such as "2 worse, 1 better, 4 within the spread".
std::string totals_of(const std::vector<Comparison>& comparisons) {
  std::string text;
  for (const Change change : {Change::worse, Change::better, Change::within_spread}) {
    const auto count = std::ranges::count(comparisons, change, &Comparison::change);
    text += fmt::format("{}{} {}", text.empty() ? "" : ", ", count, name_of(change));
  }
  return text;
}

}  // namespace

std::vector<Comparison> compare_results(const Json& before_rows, const Json& after_rows) {
  std::vector<Comparison> comparisons;
  for (const Json& after : after_rows) {
    const auto before = std::ranges::find_if(before_rows, [&after](const Json& row) {
      return row["name"] == after["name"] && row["unit"] == after["unit"];
    });
    if (before == before_rows.end()) continue;
    const auto number = [](const Json& row, const char* key) { return row[key].get<double>(); };
    Comparison comparison{.name = after["name"],
                          .unit = after["unit"],
                          .before = number(*before, "value"),
                          .after = number(after, "value")};
    if (comparison.before == 0 || number(*before, "min") <= 0) continue;  // no ratio
    comparison.ratio = comparison.after / comparison.before;
    comparison.low = number(after, "min") / number(*before, "max");
    comparison.high = number(after, "max") / number(*before, "min");
    if (const int direction = direction_of(comparison.unit); direction != 0) {
      const int change = comparison.low > 1 ? 1 : comparison.high < 1 ? -1 : 0;
      comparison.change = change == 0 ? Change::within_spread : change == direction ? Change::better : Change::worse;
    }
    comparisons.push_back(comparison);
  }
  return comparisons;
}

EarlierReport::EarlierReport(const std::string& path) : path_(path) {
  report_ = parse_json(read_file(path), /*allow_exceptions=*/false);
  const bool is_report = report_.is_object() && report_.value("results", Json()).is_array() &&
                         !report_["results"].empty() && std::ranges::all_of(report_["results"], is_row);
  const auto is_text = [this](const char* key) { return !report_.contains(key) || report_[key].is_string(); };
  PICTURA_CHECK(is_report && is_text("commit") && is_text("device") && is_text("workload"),
                "{}: expected the output of a benchmark's --json, an object with \"results\"", path);
}

void EarlierReport::add_comparison(Json* report_inout) const {
  Json rows = Json::array();
  for (const Comparison& each : compare_results(report_["results"], (*report_inout)["results"])) {
    rows.push_back({{"name", each.name},
                    {"unit", each.unit},
                    {"before", each.before},
                    {"after", each.after},
                    {"ratio", each.ratio},
                    {"low", each.low},
                    {"high", each.high},
                    {"change", name_of(each.change)}});
  }
  const auto is_equal = [&](const char* key) { return report_.value(key, Json()) == report_inout->value(key, Json()); };
  (*report_inout)["comparison"] = {{"file", path_},
                                   {"commit", report_.value("commit", "")},
                                   {"device", report_.value("device", "")},
                                   {"same_workload", is_equal("workload")},
                                   {"same_device", is_equal("device")},
                                   {"results", rows}};
}

void EarlierReport::print_comparison(const Json& report) const {
  print_result("\nagainst {}, commit {}:\n", path_, report_.value("commit", "unknown"));
  for (const char* key : {"workload", "device"}) {
    if (report_.value(key, "") != report.value(key, ""))
      print_result("  the {} differs: {}\n", key, report_.value(key, "unknown"));
  }
  const std::vector<Comparison> comparisons = compare_results(report_["results"], report["results"]);
  if (comparisons.empty()) print_result("  it has no results of these names\n");
  for (const Comparison& each : comparisons) {
    print_result("{:50} {:>14.6g} -> {:<14.6g} {:18} x{:.3f} ({:.3f} to {:.3f}) {}\n", each.name, each.before,
                 each.after, each.unit, each.ratio, each.low, each.high, name_of(each.change));
  }
  print_result("{}\n", totals_of(comparisons));
}

}  // namespace pictura
