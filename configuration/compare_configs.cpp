#include "pictura/configuration/compare_configs.h"

#include <set>

#include "pictura/configuration/config_writer.h"
#include "pictura/configuration/visit_keys.h"

namespace pictura {

namespace {

// Renderers whose images are the same by contract have one name here.
std::string drawn_by(const std::string& backend) {
  if (backend.starts_with("gl")) return "gl";
  return backend == "null" ? "null" : "exact coverage";
}

bool is_of_schedule(const std::string& key) {
  return key.starts_with("train.schedule") || key == "train.decay_agent_steps" || key == "train.warm_up_agent_steps" ||
         key == "train.learning_rate" || key == "train.sharpen_agent_steps";
}

bool is_reported(const std::string& key) {
  return is_of_schedule(key) || key.starts_with("train.teacher") || key == "train.reproducible" ||
         key == "train.weight_average" || key == "render.schedule";
}

bool may_differ(const std::string& key, const Config& saved, const Config& now) {
  static const std::set<std::string> kHarmless{"train.updates",          "train.optimizer",
                                               "train.checkpoint_every", "train.checkpoint_minutes",
                                               "train.keep_checkpoints", "train.milestone_agent_steps",
                                               "train.forward_chunk",    "train.images",
                                               "train.graphs",           "train.halted_slots",
                                               "run.num_threads",        "run.device",
                                               "policy.backbone",        "render.rig",
                                               "render.width_px",        "render.height_px",
                                               "simulator.backend"};
  if (kHarmless.count(key) || key.starts_with("evaluate.") || key.starts_with("train.evaluate_") || is_reported(key)) {
    return true;
  }
  if (key == "render.backend" && drawn_by(saved.render.backend) == drawn_by(now.render.backend)) return true;
  // The vector policy reads nothing of it, before and now, since the modality may not differ.
  return !saved.reads_images() && key.starts_with("render.");
}

// "KEY: OLD became NEW" of each key that the predicate has and in which the two differ.
template <typename Predicate>
std::vector<std::string> differences(const Config& saved, const Config& now, const Predicate& counts,
                                     const char* between = "became") {
  ConfigWriter before, after;
  visit(saved, before);
  visit(now, after);
  const std::map<std::string, std::string> values(after.lines.begin(), after.lines.end());
  std::vector<std::string> result;
  for (const auto& [key, value] : before.lines) {
    // Some keys are only written where others are not set.
    const auto other = values.find(key);
    if (counts(key) && other != values.end() && other->second != value) {
      result.push_back(fmt::format("{}: {} {} {}", key, value, between, other->second));
    }
  }
  return result;
}

}  // namespace

std::string first_difference(const Config& saved, const Config& now) {
  const std::vector<std::string> all =
      differences(saved, now, [&](const std::string& key) { return !may_differ(key, saved, now); });
  return all.empty() ? "" : all.front();
}

std::string first_difference_of_ranks(const Config& first, const Config& other) {
  const auto counts = [](const std::string& key) { return key != "run.num_threads" && key != "run.device"; };
  const std::vector<std::string> all = differences(first, other, counts, "and");
  return all.empty() ? "" : all.front();
}

std::vector<std::string> differences_to_report(const Config& saved, const Config& now) {
  return differences(saved, now, is_reported);
}

std::map<std::string, std::string> keys_of_evaluation(const Config& config, bool has_policy) {
  static const std::set<std::string> kReplaced{
      "simulator.backend",      "simulator.maps",        "simulator.map_copies",    "simulator.num_slots",
      "simulator.min_agents",   "simulator.max_agents",  "simulator.episode_steps", "simulator.reset_inactive_fraction",
      "simulator.light_cycles", "simulator.light_heads", "policy.backbone",         "policy.backbone_frozen"};
  ConfigWriter writer;
  visit(config, writer);
  std::map<std::string, std::string> keys;
  for (const auto& [key, value] : writer.lines) {
    const bool is_of_world = key.starts_with("simulator.") && !key.starts_with("simulator.conditioning.");
    const bool is_of_policy = key.starts_with("policy.") || key == "render.line_floor_px";
    if ((is_of_world || (has_policy && is_of_policy)) && !kReplaced.contains(key)) keys[key] = value;
  }
  return keys;
}

}  // namespace pictura
