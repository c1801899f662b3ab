#include "pictura/configuration/compare_configs.h"

#include "pictura/configuration/config_writer.h"
#include "pictura/configuration/visit_keys.h"

namespace pictura {

namespace {

// Returns a name for the rules by which a renderer draws. Renderers with the same name must draw identical images.
std::string drawn_by(const std::string& backend) {
  if (backend.starts_with("gl")) return "gl";
  return backend == "null" ? "null" : "exact coverage";
}

bool may_differ(const NamedKey& key, const Config& saved, const Config& now) {
  if (key.resume != Resume::fixed) return true;
  if (key.name == "render.backend" && drawn_by(saved.render.backend) == drawn_by(now.render.backend)) return true;
  // A vector policy does not use [render]. If `saved` has a vector policy, `now` has one too, because the modality must
  // not differ.
  return !saved.reads_images() && key.name.starts_with("render.");
}

// Returns "KEY: OLD became NEW" for each differing key that the predicate `counts` accepts.
template <typename Predicate>
std::vector<std::string> differences(const Config& saved, const Config& now, const Predicate& counts,
                                     const char* between = "became") {
  ConfigWriter before, after;
  visit(saved, before);
  visit(now, after);
  std::map<std::string, std::string> values;
  for (const auto& [key, value] : after.lines) values.emplace(key.name, value);
  std::vector<std::string> result;
  for (const auto& [key, value] : before.lines) {
    // Keys that are written only in one of the configurations are skipped: some keys are only written if others are not
    // set.
    const auto other = values.find(key.name);
    if (counts(key) && other != values.end() && other->second != value) {
      result.push_back(fmt::format("{}: {} {} {}", key.name, value, between, other->second));
    }
  }
  return result;
}

}  // namespace

std::string first_difference(const Config& saved, const Config& now) {
  const std::vector<std::string> all =
      differences(saved, now, [&](const NamedKey& key) { return !may_differ(key, saved, now); });
  return all.empty() ? "" : all.front();
}

std::string first_difference_of_ranks(const Config& first, const Config& other) {
  const auto counts = [](const NamedKey& key) { return key.name != "run.num_threads" && key.name != "run.device"; };
  const std::vector<std::string> all = differences(first, other, counts, "and");
  return all.empty() ? "" : all.front();
}

std::vector<std::string> differences_to_report(const Config& saved, const Config& now) {
  return differences(saved, now, [](const NamedKey& key) { return key.resume == Resume::reported; });
}

std::map<std::string, std::string> keys_of_evaluation(const Config& config, bool has_policy) {
  ConfigWriter writer;
  visit(config, writer);
  std::map<std::string, std::string> keys;
  for (const auto& [key, value] : writer.lines) {
    const bool is_of_world = key.name.starts_with("simulator.") && !key.name.starts_with("simulator.conditioning.");
    const bool is_of_policy = key.name.starts_with("policy.") || key.name == "render.line_floor_px";
    if ((is_of_world || (has_policy && is_of_policy)) && key.evaluation == Evaluation::counts) keys[key.name] = value;
  }
  return keys;
}

}  // namespace pictura
