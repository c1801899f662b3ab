// JSON format that all result files of evaluations share. Results of parts of an evaluation are merged from these
// files.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/common/support/json.h"
#include "pictura/evaluation/results.h"

namespace pictura {

Json to_json(const EvaluationSetting& setting);
EvaluationSetting setting_from(const Json& json);

/// Returns the counts of a ScenarioCounts or SceneCounts by name; counts_from() is the inverse.
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

/// Compares the JSON objects of two parts. Throws Error naming both parts and the first key with different values. Keys
/// of nested objects are written as "rules.box_scale"; `within` is the prefix of all keys.
void check_same(const Json& first, const std::string& first_name, const Json& other, const std::string& other_name,
                const std::string& within = "");

/// Reads a file's JSON. Throws Error naming the file if its format is not in `formats`. The first of `formats` is the
/// current format.
Json read_results_json(const std::string& path, const std::vector<std::string>& formats);
/// Calls parse(). Throws Error naming the file if parse() throws a JSON exception, for instance because a value is
/// missing.
void parse_results(const std::string& path, const std::function<void()>& parse);

}  // namespace pictura
