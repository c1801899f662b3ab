// What the files by which parts of evaluations are merged have in common.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/common/support/json.h"
#include "pictura/evaluation/results.h"

namespace pictura {

Json to_json(const EvaluationSetting& setting);
EvaluationSetting setting_from(const Json& json);

/// A ScenarioCounts' or a SceneCounts' counts by their names.
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

/// Throws Error naming the first key whose values differ in two parts' objects, and the parts. Keys of objects in them
/// are named as "rules.box_scale"; `within` is what stands before all keys.
void check_same(const Json& first, const std::string& first_name, const Json& other, const std::string& other_name,
                const std::string& within = "");

/// A file's JSON. Throws Error naming the file unless it is that of one of these formats, the first being the present
/// one.
Json read_results_json(const std::string& path, const std::vector<std::string>& formats);
/// Calls parse, and throws Error naming the file where that misses a value of the JSON, or throws one.
void parse_results(const std::string& path, const std::function<void()>& parse);

}  // namespace pictura
