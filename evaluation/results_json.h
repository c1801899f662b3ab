// JSON format of the result files of evaluations.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/common/support/json.h"
#include "pictura/evaluation/results.h"

namespace pictura {

Json to_json(const EvaluationSetting& setting);
EvaluationSetting setting_from(const Json& json);

/// Returns an object with the counts of a ScenarioCounts or SceneCounts.
template <typename Counts>
Json counts_json(const Counts& counts) {
  Json json;
  Counts::visit(counts, [&](const char* name, const auto& count) { json[name] = count; });
  return json;
}
template <typename Counts>
Counts counts_from(const Json& json) {
  Counts counts;
  Counts::visit(counts, [&json](const char* name, auto& count) { json.at(name).get_to(count); });
  return counts;
}

/// Throws Error if the two objects differ, naming both and the first different key, such as "rules.box_scale".
/// `within`: prefix of the key.
void check_same(const Json& first, const std::string& first_name, const Json& other, const std::string& other_name,
                const std::string& within = "");

/// Throws Error naming the file if its format is not in `formats`, whose first element is the current format.
Json read_results_json(const std::string& path, const std::vector<std::string>& formats);
/// Calls parse(). Converts its JSON exceptions to an Error naming the file.
void parse_results(const std::string& path, const std::function<void()>& parse);

}  // namespace pictura
