#include "pictura/evaluation/probes/corner_results.h"

#include <algorithm>
#include <cmath>
#include <iterator>

#include <fmt/format.h>

#include "pictura/common/support/output_file.h"
#include "pictura/evaluation/csv.h"
#include "pictura/evaluation/probes/probe_json.h"

namespace pictura {

namespace {

constexpr int kDecelerationSteps = 20;
constexpr std::array<double, 3> kQuantiles{0.1, 0.5, 0.9};
constexpr std::array<const char*, 3> kQuantileNames{"reveal_s_p10", "reveal_s_p50", "reveal_s_p90"};

/// Returns the quantile `share`, from 0 to 1, of sorted numbers, with linear interpolation.
double quantile(const std::vector<double>& sorted, double share) {
  const double at = share * static_cast<double>(sorted.size() - 1);
  const auto below = static_cast<size_t>(at);
  const size_t above = std::min(below + 1, sorted.size() - 1);
  return std::lerp(sorted[below], sorted[above], at - static_cast<double>(below));
}

// Sums of a run's measures, or of the differences of two runs, by scene.
struct MeasureSums {
  SceneMeans distance_m, corner_m, speed_mps, approach_mps, deceleration_mps2;

  void add(int32_t scene, const Reveal& one) {
    if (one.distance_m) distance_m.add(scene, static_cast<double>(*one.distance_m));
    corner_m.add(scene, static_cast<double>(one.corner_m));
    speed_mps.add(scene, static_cast<double>(one.speed_mps));
    approach_mps.add(scene, static_cast<double>(one.approach_mps));
    if (one.deceleration_mps2) deceleration_mps2.add(scene, static_cast<double>(*one.deceleration_mps2));
  }
  CornerMeasures means() const {
    return {distance_m.mean(), corner_m.mean(), speed_mps.mean(), approach_mps.mean(), deceleration_mps2.mean()};
  }
};

std::optional<float> difference(const std::optional<float>& a, const std::optional<float>& b) {
  if (!a || !b) return std::nullopt;
  return *a - *b;
}

Reveal difference(const Reveal& a, const Reveal& b) {
  return {.distance_m = difference(a.distance_m, b.distance_m),
          .corner_m = a.corner_m - b.corner_m,
          .speed_mps = a.speed_mps - b.speed_mps,
          .approach_mps = a.approach_mps - b.approach_mps,
          .deceleration_mps2 = difference(a.deceleration_mps2, b.deceleration_mps2)};
}

CornerRow runs_row(const CornerResults& results, bool walls, CornerCase its_case, size_t policy) {
  CornerRow row{.walls = walls, .its_case = its_case, .policy = policy};
  MeasureSums sums;
  std::array<SceneMeans, kTakeoverSteps + 1> speeds;
  std::vector<double> reveals_s;
  for (size_t pair = 0; pair < results.pairs.size(); ++pair) {
    const int32_t scene = results.pairs[pair].hidden.scene;
    const Takeover& run = results.takeover(pair, walls, its_case, policy);
    row.ended_early += run.ended_by != 0;
    row.entered_input += run.input_step >= 0;
    for (size_t k = 0; k < speeds.size(); ++k) {
      if (std::isfinite(run.speed_mps[k])) speeds[k].add(scene, static_cast<double>(run.speed_mps[k]));
    }
    const std::optional<Reveal> reveal = reveal_of(results, pair, walls, its_case, policy);
    if (!reveal) continue;
    sums.add(scene, *reveal);
    reveals_s.push_back(kTakeoverStep_s * reveal->step);
  }
  row.revealed = sums.speed_mps.count();
  row.scenes = sums.speed_mps.scenes();
  row.at_reveal = sums.means();
  std::sort(reveals_s.begin(), reveals_s.end());
  for (size_t i = 0; i < kQuantiles.size(); ++i) {
    row.reveal_s[i] = reveals_s.empty() ? std::nan("") : quantile(reveals_s, kQuantiles[i]);
  }
  for (size_t k = 0; k < speeds.size(); ++k) {
    row.speed_mps[k] = speeds[k].mean();
    row.driving[k] = speeds[k].count();
  }
  return row;
}

CornerRow difference_row(const CornerResults& results, CornerRow row) {
  MeasureSums sums;
  for (size_t pair = 0; pair < results.pairs.size(); ++pair) {
    const auto one = reveal_of(results, pair, row.walls, row.its_case, row.policy),
               other = reveal_of(results, pair, row.walls, row.less_case.value_or(row.its_case),
                                 row.less_policy.value_or(row.policy));
    if (one && other) sums.add(results.pairs[pair].hidden.scene, difference(*one, *other));
  }
  row.revealed = sums.speed_mps.count();
  row.scenes = sums.speed_mps.scenes();
  row.at_reveal = sums.means();
  return row;
}

const char* name_of(CornerCase its_case) { return kCornerCaseNames[static_cast<size_t>(its_case)]; }

Json to_json(const CornerRow& row, const CornerResults& results) {
  Json json = {{"walls", row.walls},
               {"case", name_of(row.its_case)},
               {"policy", results.policies[row.policy].name},
               {"less_policy", row.less_policy ? Json(results.policies[*row.less_policy].name) : Json(nullptr)},
               {"less_case", row.less_case ? Json(name_of(*row.less_case)) : Json(nullptr)},
               {"revealed", row.revealed},
               {"scenes", row.scenes}};
  add_estimate("distance_m", row.at_reveal.distance_m, &json);
  add_estimate("corner_m", row.at_reveal.corner_m, &json);
  add_estimate("speed_mps", row.at_reveal.speed_mps, &json);
  add_estimate("approach_mps", row.at_reveal.approach_mps, &json);
  add_estimate("deceleration_mps2", row.at_reveal.deceleration_mps2, &json);
  if (row.less_policy || row.less_case) return json;
  json["runs"] = results.pairs.size();
  json["ended_early"] = row.ended_early;
  json["entered_input"] = row.entered_input;
  for (size_t i = 0; i < kQuantiles.size(); ++i) json[kQuantileNames[i]] = finite_or_null(row.reveal_s[i]);
  Json curve = Json::array(), half_width = Json::array();
  for (const Estimate& speed : row.speed_mps) {
    curve.push_back(finite_or_null(speed.value));
    half_width.push_back(finite_or_null(speed.half_width_95));
  }
  json["speed_curve_mps"] = std::move(curve);
  json["speed_curve_mps_half_width_95"] = std::move(half_width);
  json["driving"] = row.driving;
  return json;
}

std::string text_of(const std::optional<float>& number) { return number ? fmt::format("{:.3f}", *number) : ""; }

std::string seconds_of(int32_t step) { return step < 0 ? "" : fmt::format("{:.1f}", kTakeoverStep_s * step); }

}  // namespace

std::optional<Reveal> reveal_of(const CornerResults& results, size_t pair, bool walls, CornerCase its_case,
                                size_t policy) {
  const Takeover& run = results.takeover(pair, walls, its_case, policy);
  const bool is_empty = its_case == CornerCase::empty;
  const int32_t step = is_empty ? results.takeover(pair, walls, CornerCase::hidden, policy).sight_step : run.sight_step;
  if (step < 0 || !std::isfinite(run.speed_mps[step])) return std::nullopt;
  const auto at = static_cast<size_t>(step);
  const CornerPair& its_pair = results.pairs[pair];
  Reveal reveal{.step = step,
                .corner_m = (is_empty ? its_pair.empty : its_pair.hidden).distance_m,
                .speed_mps = run.speed_mps[at]};
  if (!is_empty) reveal.distance_m = run.sight_distance_m;
  for (size_t k = 0; k <= at; ++k) {
    reveal.approach_mps += run.speed_mps[k] / static_cast<float>(at + 1);
    if (k > 0) reveal.corner_m -= std::hypot(run.x_m[k] - run.x_m[k - 1], run.y_m[k] - run.y_m[k - 1]);
  }
  const size_t later = at + kDecelerationSteps;
  if (later < run.speed_mps.size() && std::isfinite(run.speed_mps[later])) {
    reveal.deceleration_mps2 =
        (run.speed_mps[at] - run.speed_mps[later]) / static_cast<float>(kTakeoverStep_s * kDecelerationSteps);
  }
  return reveal;
}

std::vector<CornerRow> summarize(const CornerResults& results) {
  constexpr CornerCase kCases[] = {CornerCase::hidden, CornerCase::removed, CornerCase::empty};
  const size_t num_policies = results.policies.size();
  std::vector<CornerRow> rows;
  for (const bool walls : {true, false}) {
    for (size_t policy = 0; policy < num_policies; ++policy) {
      for (const CornerCase its_case : kCases) rows.push_back(runs_row(results, walls, its_case, policy));
    }
    for (size_t policy = 1; policy < num_policies; ++policy) {
      for (const CornerCase its_case : kCases) {
        rows.push_back(difference_row(
            results, {.walls = walls, .its_case = its_case, .policy = policy, .less_policy = size_t{0}}));
      }
    }
    for (size_t policy = 0; policy < num_policies; ++policy) {
      for (const CornerCase less : {CornerCase::removed, CornerCase::empty})
        rows.push_back(difference_row(results, {.walls = walls, .policy = policy, .less_case = less}));
    }
  }
  return rows;
}

size_t example_of(const CornerResults& results) {
  size_t example = 0;
  float most = -1;
  for (size_t pair = 0; pair < results.pairs.size(); ++pair) {
    std::vector<float> speeds;
    for (size_t policy = 0; policy < results.policies.size(); ++policy) {
      const auto reveal = reveal_of(results, pair, true, CornerCase::hidden, policy);
      if (reveal) speeds.push_back(reveal->speed_mps);
    }
    if (speeds.size() < results.policies.size()) continue;
    const auto [low, high] = std::minmax_element(speeds.begin(), speeds.end());
    if (*high - *low <= most) continue;
    most = *high - *low;
    example = pair;
  }
  return example;
}

void write_corner_cases(const std::string& path, const CornerResults& results) {
  OutputFile file(path);
  std::string header =
      "run,pair,walls,case,policy,scene,map,driver,step,ego,user,removed,corner_distance_m,start_speed_mps,lasted_s,"
      "ended_by,"
      "input_s,sight_s,reveal_s,reveal_distance_m,reveal_corner_m,reveal_speed_mps,approach_mps,deceleration_mps2";
  for (int k = 0; k <= kTakeoverSteps; ++k)
    fmt::format_to(std::back_inserter(header), ",speed_mps_{:.1f}", kTakeoverStep_s * k);
  file.write(header + '\n');
  size_t run = 0;
  for (size_t pair = 0; pair < results.pairs.size(); ++pair) {
    for (const bool walls : {true, false}) {
      for (size_t i = 0; i < kCornerCases; ++i) {
        const auto its_case = static_cast<CornerCase>(i);
        const CornerPair& both = results.pairs[pair];
        const CornerState& state = its_case == CornerCase::empty ? both.empty : both.hidden;
        for (size_t policy = 0; policy < results.policies.size(); ++policy) {
          const Takeover& one = results.takeover(pair, walls, its_case, policy);
          const std::optional<Reveal> reveal = reveal_of(results, pair, walls, its_case, policy);
          std::string row = fmt::format(
              "{},{},{},{},{},{},{},{},{},{},{},{},{:.3f},{:.3f},{:.1f},{},{},{}", run++, pair,
              kWallNames[walls ? 0 : 1], name_of(its_case), csv_quoted(results.policies[policy].name), state.scene,
              csv_quoted(results.setting.maps[state.map]), csv_quoted(results.driver_name(state.driver)), state.step,
              state.ego, state.user, its_case == CornerCase::removed ? results.scenes_of_pairs[pair].removed : -1,
              state.distance_m, state.speed_mps, kTakeoverStep_s * one.steps, one.ended_by, seconds_of(one.input_step),
              seconds_of(one.sight_step));
          if (reveal) {
            fmt::format_to(std::back_inserter(row), ",{},{},{:.3f},{:.3f},{:.3f},{}", seconds_of(reveal->step),
                           text_of(reveal->distance_m), reveal->corner_m, reveal->speed_mps, reveal->approach_mps,
                           text_of(reveal->deceleration_mps2));
          } else {
            row += ",,,,,,";
          }
          for (const float speed_mps : one.speed_mps)
            row += std::isfinite(speed_mps) ? fmt::format(",{:.3f}", speed_mps) : ",";
          file.write(row + '\n');
        }
      }
    }
  }
  file.commit();
}

std::string corner_summary_json(const CornerResults& results, const std::vector<CornerRow>& rows,
                                const std::string& cases_file) {
  std::vector<int32_t> drivers;
  for (const CornerPair& pair : results.pairs) drivers.push_back(pair.hidden.driver);
  const CornerSearch& search = results.search;
  Json json = {{"kind", "corner"},
               {"policy", policies_json(results, drivers)},
               {"control", kCornerControlNames[static_cast<size_t>(results.control)]},
               {"pairs", results.pairs.size()},
               {"pairs_asked", results.pairs_asked},
               {"hidden_found", results.hidden_found},
               {"empty_found", results.empty_found},
               {"cases", results.takeovers.size()},
               {"cases_file", cases_file.empty() ? Json(nullptr) : Json(cases_file)},
               {"takeover_steps", kTakeoverSteps},
               {"min_distance_m", search.min_distance_m},
               {"max_distance_m", search.max_distance_m},
               {"min_speed_mps", search.min_speed_mps},
               {"user_range_m", search.user_range_m}};
  return summary_text(results, std::move(json), rows,
                      [&results](const CornerRow& row) { return to_json(row, results); });
}

}  // namespace pictura
