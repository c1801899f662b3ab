#include <algorithm>
#include <cmath>
#include <filesystem>
#include <set>
#include <sstream>

#include <fmt/ranges.h>
#include <toml++/toml.h>

#include "pictura/common/pixel_samples.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/common/support/toml_fields.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/configuration/config_writer.h"
#include "pictura/configuration/removed_keys.h"
#include "pictura/configuration/visit_keys.h"
#include "pictura/configuration/visit_paths.h"
#include "pictura/simulator/conditioning_lookup.h"

namespace pictura {

namespace {

/// Visitor that reads each key from a file and its overrides.
class Reader {
 public:
  /// With `any_name`, names of backends are not checked.
  Reader(const toml::table& table, std::string source, const std::set<std::string>& overridden, bool any_name)
      : table_(table), source_(std::move(source)), overridden_(overridden), any_name_(any_name) {}

  template <std::integral Int>
  void value(const std::string& key, Int& value, int64_t low, int64_t high) {
    if (const toml::node* node = find(key)) {
      const int64_t number = integer_of(key, *node, low, high);
      value = static_cast<Int>(number);
    }
  }

  /// Reads a key that has no effect if the key `other` is set. `other` must have been visited before.
  template <typename Int>
  void value_unless(const std::string& other, bool is_set, const std::string& key, Int& its_value, int64_t low,
                    int64_t high) {
    if (find(key) && is_set)
      throw_error(key, fmt::format("has no effect together with {}: omit one of the two", other));
    value(key, its_value, low, high);
  }

  template <std::floating_point Real>
  void value(const std::string& key, Real& value, double low, double high) {
    if (const toml::node* node = find(key)) value = static_cast<Real>(number_of(key, *node, low, high));
  }

  void value(const std::string& key, bool& value) {
    if (const toml::node* node = find(key)) {
      if (!node->is_boolean()) throw_error(key, *node, "expected true or false");
      value = node->as_boolean()->get();
    }
  }

  void value(const std::string& key, std::string& value) {
    if (const toml::node* node = find(key)) value = text_of(key, *node);
  }

  void name(const std::string& key, std::string& value, const std::vector<std::string>& known) {
    const toml::node* node = find(key);
    if (!node) return;
    value = text_of(key, *node);
    if (any_name_ || std::find(known.begin(), known.end(), value) != known.end()) return;
    reject_name(key, *node, value, known);
  }

  void device(const std::string& key, std::string& value) {
    if (const toml::node* node = find(key)) {
      value = text_of(key, *node);
      if (!is_device(value)) throw_error(key, *node, fmt::format("expected one of {}", kDevices));
    }
  }

  void samples(const std::string& key, PixelSamples& value) {
    if (const toml::node* node = find(key)) {
      const std::string text = node->is_integer() ? fmt::format("{}", node->as_integer()->get()) : text_of(key, *node);
      const std::optional<PixelSamples> parsed = parse_pixel_samples(text);
      if (!parsed) throw_error(key, *node, fmt::format("expected {}", kPixelSamplesExpected));
      value = *parsed;
    }
  }

  /// Reads run.backend, the old name of two keys, and sets those of the two that are absent.
  void old_backend(const std::string& key, std::string& simulator, std::string& renderer) {
    const toml::node* node = find(key);
    if (!node) return;
    const toml::node *new_simulator = find("simulator.backend"), *new_renderer = find("render.backend");
    if (new_simulator && new_renderer) {
      throw_error(key, "has no effect together with simulator.backend and render.backend: omit it");
    }
    std::string its_name;
    name(key, its_name, renderer_names());
    if (!new_renderer) renderer = its_name;
    // For renderers without a simulator of the same name, earlier versions used the simulator `cpu`.
    if (!new_simulator) simulator = its_name == "cuda" || its_name == "auto" ? its_name : "cpu";
  }

  /// Reads the old key of the schedule, whose unit is updates of at most agent_steps_per_update agent-steps.
  void old_schedule(const std::string& key, int64_t agent_steps_per_update, int64_t& schedule_agent_steps) {
    if (!find(key)) return;
    if (find("train.schedule_agent_steps")) throw_error(key, "has no effect together with train.schedule_agent_steps");
    constexpr int64_t kMost = int64_t{1} << 60;
    int64_t updates = 0;
    value(key, updates, 1, int64_t{1} << 40);
    schedule_agent_steps = updates > kMost / agent_steps_per_update ? kMost : updates * agent_steps_per_update;
  }

  /// Reads a removed key. Only the value of RemovedKey::value is valid.
  void removed(const RemovedKey& key) {
    const toml::node* node = find(key.name);
    if (!node) return;
    std::ostringstream value;
    value << toml::json_formatter(*node);
    if (value.str() == key.value) return;
    throw_error(key.name, fmt::format("expected {}, got {}: {}", key.value, value.str(), key.reason));
  }

  /// Reads a list of texts, which may be empty only if its default is empty.
  void texts(const std::string& key, std::vector<std::string>& value) {
    if (const toml::node* node = find(key)) {
      if (value.empty() && node->is_array() && node->as_array()->empty()) return;
      value.clear();
      for (const toml::node& element : elements_of(key, *node)) value.push_back(text_of(key, element));
    }
  }

  void integers(const std::string& key, std::vector<int>& value, int64_t low, int64_t high) {
    if (const toml::node* node = find(key)) {
      value.clear();
      for (const toml::node& element : elements_of(key, *node)) {
        value.push_back(static_cast<int>(integer_of(key, element, low, high)));
      }
    }
  }

  /// Reads [[agent_steps, width_px, height_px] or [agent_steps, width_px, height_px, patch_px, line_floor_px], ...].
  void size_changes(const std::string& key, std::vector<RenderSection::SizeChange>& value) {
    const toml::node* node = find(key);
    if (!node) return;
    const std::string expected = fmt::format("expected {}", kSizeChangesExpected);
    if (!node->is_array()) throw_error(key, *node, expected);
    value.clear();
    for (const toml::node& element : *node->as_array()) {
      const toml::array* const change = element.as_array();
      if (!change || (change->size() != 3 && change->size() != 5)) throw_error(key, *node, expected);
      constexpr int64_t kMostPixels = 8192;
      value.push_back({integer_of(key, (*change)[0], 1, int64_t{1} << 60),
                       static_cast<int>(integer_of(key, (*change)[1], 1, kMostPixels)),
                       static_cast<int>(integer_of(key, (*change)[2], 1, kMostPixels))});
      if (change->size() == 5) {
        value.back().patch_px = static_cast<int>(integer_of(key, (*change)[3], 1, kMaxPatch_px));
        value.back().line_floor_px = number_of(key, (*change)[4], 0, kMaxLineFloor_px);
      }
      if (value.size() > 1 && value.back().agent_steps <= value[value.size() - 2].agent_steps) {
        throw_error(key, *node, "expected ascending agent_steps");
      }
    }
  }

  template <typename Enum>
  void choice(const std::string& key, Enum& value, Span<const char* const> names) {
    const toml::node* node = find(key);
    if (!node) return;
    const std::string text = text_of(key, *node);
    const auto found = std::find(names.begin(), names.end(), text);
    if (found == names.end()) reject_name(key, *node, text, {names.begin(), names.end()});
    value = static_cast<Enum>(found - names.begin());
  }

  void range(const std::string& key, ConditioningRange& value) {
    if (const toml::node* node = find(key)) {
      const toml::array& pair = elements_of(key, *node);
      if (pair.size() != 2) throw_error(key, *node, "expected [low, high]");
      value.low = static_cast<float>(number_of(key, pair[0], -kMaxConditioning, kMaxConditioning));
      value.high = static_cast<float>(number_of(key, pair[1], -kMaxConditioning, kMaxConditioning));
      if (value.low > value.high) throw_error(key, *node, "expected low <= high");
      const bool is_fixed = value.low == value.high;
      if (value.mixture && !(value.low > 0 && (is_fixed || (value.low <= 1 && value.high >= 1)))) {
        throw_error(key, *node, "expected 0 < low <= 1 <= high, or low = high > 0");
      }
    }
  }

  /// Throws Error for the first key of the table that was not read.
  void reject_unknown_keys(const toml::table& table, const std::string& prefix = "") const {
    for (const auto& [name, node] : table) {
      const std::string key = prefix + std::string(name.str());
      // For an unknown section, the error names the section's first key.
      if (const toml::table* inner = node.as_table(); inner && (sections_.count(key) || !inner->empty()))
        reject_unknown_keys(*inner, key + ".");
      else if (!known_.count(key))
        reject_unknown_key(key, node);
    }
  }

  [[noreturn]] void throw_error(const std::string& key, const toml::node& node, const std::string& expected) const {
    throw_error(key, fmt::format("{}, got {}", expected, format_value(node)));
  }
  [[noreturn]] void throw_error(const std::string& key, const std::string& message) const {
    if (overridden_.count(key)) fail("--set {}: {}", key, message);
    const toml::node* node = table_.at_path(key).node();
    fail("{}: {}: {}", node ? line_of(*node) : source_, key, message);
  }

 private:
  [[noreturn]] void reject_name(const std::string& key, const toml::node& node, const std::string& name,
                                const std::vector<std::string>& known) const {
    throw_error(key, fmt::format("expected one of {}, got {}{}", fmt::join(known, ", "), format_value(node),
                                 suggestion(name, known)));
  }

  const toml::node* find(const std::string& key) {
    known_.insert(key);
    for (size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', dot + 1)) {
      sections_.insert(key.substr(0, dot));
    }
    return table_.at_path(key).node();
  }

  std::string line_of(const toml::node& node) const { return fmt::format("{}:{}", source_, node.source().begin.line); }

  [[noreturn]] void reject_unknown_key(const std::string& key, const toml::node& node) const {
    if (overridden_.count(key)) fail("--set {}: unknown key{}", key, suggestion_for(key));
    fail("{}: unknown key '{}'{}", line_of(node), key, suggestion_for(key));
  }

  int64_t integer_of(const std::string& key, const toml::node& node, int64_t low, int64_t high) const {
    const std::optional<int64_t> number = whole_number(node);
    if (!number || *number < low || *number > high) {
      throw_error(key, node, fmt::format("expected an integer in [{}, {}]", low, high));
    }
    return *number;
  }

  double number_of(const std::string& key, const toml::node& node, double low, double high) const {
    const auto number = node.value<double>();
    if (!number || !(*number >= low && *number <= high)) {
      throw_error(key, node, fmt::format("expected a number in [{}, {}]", text_of_number(low), text_of_number(high)));
    }
    return *number;
  }

  std::string text_of(const std::string& key, const toml::node& node) const {
    if (!node.is_string()) throw_error(key, node, "expected a string");
    return node.as_string()->get();
  }

  const toml::array& elements_of(const std::string& key, const toml::node& node) const {
    if (!node.is_array() || node.as_array()->empty())
      throw_error(key, node, "expected a list with one element or more");
    return *node.as_array();
  }

  // Suggests a known key with the same last part, because the section may be missing or wrong. Else suggests the
  // nearest known key.
  std::string suggestion_for(const std::string& key) const {
    const std::vector<std::string> known(known_.begin(), known_.end());
    const std::string last = key.substr(key.rfind('.') + 1);
    for (const std::string& each : known) {
      if (each.substr(each.rfind('.') + 1) == last) return fmt::format("; did you mean '{}'?", each);
    }
    const std::string nearest = suggestion(key, known);
    return nearest.empty() ? "; docs/reference/configuration.md lists every key" : nearest;
  }

  const toml::table& table_;
  std::string source_;
  const std::set<std::string>& overridden_;
  bool any_name_;
  std::set<std::string> known_, sections_;
};

// Parses a value of --set as TOML. Numbers have the same notation as in other options of the command. A value that is
// not TOML is a string, so that run.device=cpu works.
toml::table parse_override(const std::string& value) {
  toml::table parsed;
  const std::optional<int64_t> whole = parse_integer(value);
  const std::optional<double> number = parse_number(value);
  if (whole) {
    parsed.insert("value", *whole);
  } else if (number) {
    parsed.insert("value", *number);
  } else if (looks_like_number(value)) {
    parsed.insert("value", value);
  } else {
    try {
      parsed = toml::parse("value = " + value);
    } catch (const toml::parse_error&) {
      parsed.insert("value", value);
    }
  }
  return parsed;
}

// Applies an override such as "train.updates=2" to the table. "train.updates=" removes the key. Returns the key.
std::string apply_override(const std::string& text, toml::table* table_inout) {
  const size_t equals = text.find('=');
  if (equals == std::string::npos || equals == 0) fail_usage("--set {}: expected section.key=value", text);
  const std::string key = text.substr(0, equals), value = text.substr(equals + 1);
  toml::table* section = table_inout;
  size_t begin = 0;
  for (size_t dot = key.find('.'); dot != std::string::npos; begin = dot + 1, dot = key.find('.', begin)) {
    const std::string name = key.substr(begin, dot - begin);
    if (!section->contains(name)) section->insert(name, toml::table{});
    section = section->get(name)->as_table();
    if (!section) fail_usage("--set {}: '{}' is no section", text, key.substr(0, dot));
  }
  if (value.empty()) {
    section->erase(key.substr(begin));
    return key;
  }
  toml::table parsed = parse_override(value);
  if (parsed.size() != 1) fail_usage("--set {}: expected one value", text);
  parsed.get("value")->visit([&](auto& node) { section->insert_or_assign(key.substr(begin), std::move(node)); });
  return key;
}

// Removes the file's image sizes if an override sets a rig, because the rig has its own sizes.
void drop_sizes_beside_rig(const std::set<std::string>& overridden, toml::table* table_inout) {
  toml::table* const render = table_inout->get_as<toml::table>("render");
  if (!render || !overridden.count("render.rig") || (*render)["rig"].value_or(std::string()).empty()) return;
  for (const char* key : {"width_px", "height_px"}) {
    if (!overridden.count(fmt::format("render.{}", key))) render->erase(key);
  }
}

void check_patch_changes(const Config& c, const Reader& reader) {
  ImageSize size{c.render.width_px, c.render.height_px};
  int patch_px = c.policy.patch_px;
  for (const RenderSection::SizeChange& change : c.render.schedule) {
    const ImageSize next{change.width_px, change.height_px};
    if (change.has_patches() && c.policy.backbone != "conv") {
      reader.throw_error("render.schedule", "patches have no effect with a program in policy.backbone");
    }
    if (change.has_patches() && change.patch_px != patch_px) {
      const int factor = whole_factor(size, next);
      if (factor == 0 || change.patch_px != factor * patch_px) {
        reader.throw_error(
            "render.schedule",
            fmt::format("from {} agent-steps on: expected images and patches that are both the same integer "
                        "multiple of {}x{} in patches of {}, got {}x{} in patches of {}",
                        change.agent_steps, size.width_px, size.height_px, patch_px, next.width_px, next.height_px,
                        change.patch_px));
      }
      patch_px = change.patch_px;
    }
    size = next;
  }
}

// Throws Error for settings that recorded scenes do not support.
void check_scenes(const Config& c, const Reader& reader) {
  for (const std::string& map : c.simulator.maps) {
    const std::optional<std::string> source = scene_source(map);
    if (!source || source->empty()) {
      reader.throw_error("simulator.maps",
                         fmt::format("expected only recorded scenes, each as scenes:NAME, got '{}'", map));
    }
  }
  if (c.simulator.map_copies > 0) reader.throw_error("simulator.map_copies", "expected 0 with recorded scenes");
  if (c.train.evaluate_every > 0) {
    reader.throw_error("train.evaluate_every",
                       "expected 0 with recorded scenes: evaluate checkpoints with --protocol instead");
  }
  try {
    c.simulator.scenes.training_protocol();
  } catch (const UsageError& error) {
    reader.throw_error("simulator.scenes", error.what());
  }
}

void check_contradictions(const Config& c, const Reader& reader) {
  if (c.simulator.min_agents > c.simulator.max_agents) {
    reader.throw_error("simulator.min_agents", fmt::format("expected at most simulator.max_agents ({}), got {}",
                                                           c.simulator.max_agents, c.simulator.min_agents));
  }
  if (c.simulator.pedestrian_fraction + c.simulator.cyclist_fraction > 1) {
    reader.throw_error("simulator.pedestrian_fraction",
                       fmt::format("expected at most 1 together with simulator.cyclist_fraction, got {} + {}",
                                   c.simulator.pedestrian_fraction, c.simulator.cyclist_fraction));
  }
  if (c.simulator.has_scenes()) {
    check_scenes(c, reader);
  } else if (std::any_of(c.simulator.maps.begin(), c.simulator.maps.end(), scene_source)) {
    reader.throw_error("simulator.maps", "expected either roads or recorded scenes (scenes:NAME), got both");
  }
  const std::string policies = "simulator.others.policies";
  if (c.simulator.other_policies.size() > kMaxOtherPolicies) {
    reader.throw_error(policies, fmt::format("expected at most {} policies, got {}", kMaxOtherPolicies,
                                             c.simulator.other_policies.size()));
  }
  const OtherShares& others = c.simulator.others;
  double shares = static_cast<double>(others.sum());
  for (const std::string& text : c.simulator.other_policies) {
    const std::optional<NamedShare> policy = parse_share(text);
    if (!policy) {
      reader.throw_error(
          policies,
          fmt::format("expected a policy's file and its share above 0, for instance models/vector.safetensors=0.1, "
                      "got '{}'",
                      text));
    }
    shares += policy->share;
  }
  if (shares >= 1) {
    reader.throw_error(
        "simulator.others",
        fmt::format("expected shares that sum to less than 1, since the other agents learn, got {:.6g}", shares));
  }
  const size_t layers = c.policy.conv_channels.size();
  for (const auto& [key, values] : {std::pair{"policy.conv_kernels", &c.policy.conv_kernels},
                                    std::pair{"policy.conv_strides", &c.policy.conv_strides}}) {
    if (values->size() != layers) {
      reader.throw_error(
          key, fmt::format("expected {} values, as many as policy.conv_channels, got {}", layers, values->size()));
    }
  }
  if (c.train.num_steps % c.policy.decision_steps != 0) {
    reader.throw_error("train.num_steps", fmt::format("expected a multiple of policy.decision_steps ({}), got {}",
                                                      c.policy.decision_steps, c.train.num_steps));
  }
  if (c.policy.decision_steps > 1 && c.train.halted_slots == HaltedSlots::draw) {
    reader.throw_error("train.halted_slots", "\"draw\" expects policy.decision_steps = 1");
  }
  for (const int kernel : c.policy.conv_kernels) {
    if (kernel % 2 == 0) reader.throw_error("policy.conv_kernels", fmt::format("expected odd sizes, got {}", kernel));
  }
  if (!c.render.schedule.empty() && !c.render.rig.empty()) {
    reader.throw_error("render.schedule", "has no effect together with render.rig, whose file gives the sizes");
  }
  if (!c.render.schedule.empty() && !c.reads_images()) {
    reader.throw_error("render.schedule", "has no effect with the modality \"vector\", which reads no images");
  }
  if (c.policy.backbone != "conv" && !c.reads_images()) {
    reader.throw_error("policy.backbone", "has no effect with the modality \"vector\", which reads no images");
  }
  if (c.policy.backbone == "conv" && c.policy.conv_channels.back() % c.policy.attention_heads != 0) {
    reader.throw_error("policy.attention_heads",
                       fmt::format("expected a divisor of the last of policy.conv_channels ({}), got {}",
                                   c.policy.conv_channels.back(), c.policy.attention_heads));
  }
  if (c.policy.auxiliary && c.policy.modality == Modality::perspective) {
    reader.throw_error("policy.auxiliary",
                       "has no effect with the modality \"perspective\": images have no auxiliary slots");
  }
  if (c.policy.segment_features && c.policy.modality == Modality::perspective) {
    reader.throw_error("policy.segment_features",
                       "has no effect with the modality \"perspective\", which reads no segments");
  }
  if (c.simulator.wall_observations && c.policy.modality == Modality::perspective) {
    reader.throw_error("simulator.wall_observations",
                       "has no effect with the modality \"perspective\": such a policy observes walls in its images");
  }
  if (c.train.decay_agent_steps > c.train.schedule_agent_steps) {
    reader.throw_error("train.decay_agent_steps",
                       fmt::format("expected at most train.schedule_agent_steps ({}), got {}",
                                   c.train.schedule_agent_steps, c.train.decay_agent_steps));
  }
  if (c.train.halted_slots == HaltedSlots::draw && c.train.adv_filter == FilterThreshold::quantile) {
    reader.throw_error("train.halted_slots",
                       "\"draw\" uses every transition: expected train.adv_filter = \"maximum\", got \"quantile\"");
  }
  if (c.train.halted_slots == HaltedSlots::draw && c.train.adv_filter_threshold > 0) {
    reader.throw_error("train.halted_slots",
                       fmt::format("\"draw\" uses every transition: expected train.adv_filter_threshold = 0, got {}",
                                   shortest(c.train.adv_filter_threshold)));
  }
  if (c.render.samples != PixelSamples{} && !c.render.backend.starts_with("gl")) {
    reader.throw_error("render.samples", fmt::format("expected one sample with render.backend \"{}\", got {}: only gl "
                                                     "supports samples; the other renderers compute exact coverage",
                                                     c.render.backend, text_of(c.render.samples)));
  }
}

}  // namespace

namespace {

Config parse(const std::string& text, const std::string& source, const std::vector<std::string>& overrides,
             bool any_name) {
  toml::table table = parse_toml(text, source);
  std::set<std::string> overridden;
  for (const std::string& text_of_one : overrides) overridden.insert(apply_override(text_of_one, &table));
  drop_sizes_beside_rig(overridden, &table);

  Config config;
  Reader reader(table, source, overridden, any_name);
  visit(config, reader);
  reader.old_backend("run.backend", config.simulator.backend, config.render.backend);
  reader.old_schedule("train.schedule_updates", int64_t{config.simulator.num_slots} * config.train.num_steps,
                      config.train.schedule_agent_steps);
  for (const RemovedKey& key : kRemovedKeys) reader.removed(key);
  reader.reject_unknown_keys(table);
  try {
    config.simulator.maps = expand_map_names(config.simulator.maps);
  } catch (const UsageError& error) {
    reader.throw_error("simulator.maps", error.what());
  }
  check_contradictions(config, reader);
  // A saved configuration is not checked, because its sizes may be those after changes of the schedule.
  if (!any_name) check_patch_changes(config, reader);
  // A saved configuration may contain such values, because earlier versions accepted them.
  if (!any_name && config.simulator.min_agents > config.simulator.num_slots) {
    reader.throw_error("simulator.min_agents", fmt::format("expected at most simulator.num_slots ({}), got {}",
                                                           config.simulator.num_slots, config.simulator.min_agents));
  }
  return config;
}

}  // namespace

Config parse_config(const std::string& text, const std::string& source, const std::vector<std::string>& overrides) {
  return parse(text, source, overrides, /*any_name=*/false);
}

Config parse_saved_config(const std::string& text, const std::string& source) {
  return parse(text, source, {}, /*any_name=*/true);
}

Config with_evaluate_conditioning(const Config& config, const std::vector<std::string>& values) {
  Config result = config;
  std::set<size_t> given;
  for (const std::string& value : values) {
    const size_t equals = value.find('=');
    if (equals == std::string::npos) fail_usage("--conditioning: expected NAME=VALUE, got '{}'", value);
    const size_t index = conditioning_index(value.substr(0, equals), "--conditioning");
    const std::optional<double> number = parse_number(value.substr(equals + 1));
    if (!number || !(std::abs(*number) <= kMaxConditioning)) {
      fail_usage("--conditioning: {}: expected a number in [{}, {}], got '{}'", kConditioningNames[index],
                 text_of_number(-kMaxConditioning), text_of_number(kMaxConditioning), value.substr(equals + 1));
    }
    if (!given.insert(index).second) fail_usage("--conditioning: {} is given twice", kConditioningNames[index]);
    result.evaluate.conditioning[index] = *number;
  }
  return result;
}

Config load_config(const std::string& path, const std::vector<std::string>& overrides) {
  Config config = parse_config(read_file(path, 1 << 20), path, overrides);
  const auto is_overridden = [&overrides](std::string_view key) {
    return std::any_of(overrides.begin(), overrides.end(), [key](const std::string& text) {
      return text.starts_with(key) && text.substr(key.size()).starts_with('=');
    });
  };
  visit_paths(&config, [&](std::string_view key, std::string* path_inout) {
    const std::filesystem::path file(*path_inout);
    if (file.empty() || file.is_absolute() || is_overridden(key)) return;
    *path_inout = (std::filesystem::path(path).parent_path() / file).lexically_normal().string();
  });
  return config;
}

}  // namespace pictura
