#include "pictura/training/config.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>
#include <map>
#include <set>

#include <fmt/ranges.h>
#include <toml++/toml.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/error.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/common/support/toml_fields.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_copy.h"
#include "pictura/simulator/conditioning_lookup.h"
#include "pictura/training/config_keys.h"

namespace pictura {

namespace {

template <typename Enum>
using Choices = std::vector<std::pair<std::string, Enum>>;
const Choices<Modality> kModalities{{"perspective", Modality::perspective}, {"vector", Modality::vector}};
const Choices<Precision> kPrecisions{{"fp32", Precision::fp32}, {"tf32", Precision::tf32}, {"bf16", Precision::bf16}};
const Choices<Schedule> kSchedules{
    {"constant", Schedule::constant}, {"linear", Schedule::linear}, {"cosine", Schedule::cosine}};
const Choices<OptimizerKind> kOptimizers{{"adamw", OptimizerKind::adamw}, {"muon", OptimizerKind::muon}};
const Choices<ValueHead> kValueHeads{
    {"linear", ValueHead::linear}, {"symlog", ValueHead::symlog}, {"two_hot", ValueHead::two_hot}};
const Choices<FilterThreshold> kFilterThresholds{{"maximum", FilterThreshold::maximum},
                                                 {"quantile", FilterThreshold::quantile}};
const Choices<LightCycles> kLightCycles{{name_of(LightCycles::phases), LightCycles::phases},
                                        {name_of(LightCycles::independent), LightCycles::independent}};
const Choices<LightHeads> kLightHeads{{name_of(LightHeads::as_mapped), LightHeads::as_mapped},
                                      {name_of(LightHeads::visible), LightHeads::visible}};
const Choices<HaltedSlots> kHaltedSlots{{"skip", HaltedSlots::skip}, {"draw", HaltedSlots::draw}};

constexpr const char* kDevices = "cpu, cuda, cuda:N, auto";
constexpr const char* kSizeChangesExpected =
    "a list of [agent_steps, width_px, height_px] or [agent_steps, width_px, height_px, patch_px, line_floor_px]";

// The list of keys, in the order in which they are written. Reader and writer both walk it, so no key can be read and
// not written. A visitor takes (key, value, range...).
template <typename AnyConfig, typename Visitor>
void visit(AnyConfig& c, Visitor&& v) {
  const double inf = std::numeric_limits<double>::infinity();
  v.integer("run.seed", c.run.seed, 0, std::numeric_limits<int64_t>::max());
  v.integer("run.num_threads", c.run.num_threads, 0, kMaxThreads);
  v.device("run.device", c.run.device);

  v.name("simulator.backend", c.simulator.backend, simulator_names());
  v.texts("simulator.maps", c.simulator.maps);
  v.integer("simulator.map_copies", c.simulator.map_copies, 0, kMaxMapCopies);
  v.integer("simulator.num_slots", c.simulator.num_slots, 1, 1 << 22);
  v.integer("simulator.min_agents", c.simulator.min_agents, 1, kMaxAgentsPerWorld);
  v.integer("simulator.max_agents", c.simulator.max_agents, 1, kMaxAgentsPerWorld);
  v.integer("simulator.episode_steps", c.simulator.episode_steps, 1, 1 << 24);
  v.number("simulator.reset_inactive_fraction", c.simulator.reset_inactive_fraction, 1e-6, 2);
  v.number("simulator.pedestrian_fraction", c.simulator.pedestrian_fraction, 0, 1);
  v.number("simulator.cyclist_fraction", c.simulator.cyclist_fraction, 0, 1);
  v.integer("simulator.parked_cars", c.simulator.parked_cars, 0, kMaxAgentsPerWorld);
  v.choice("simulator.light_cycles", c.simulator.light_cycles, kLightCycles);
  v.flag("simulator.walls", c.simulator.walls);
  v.integer("simulator.wall_seed", c.simulator.wall_seed, 0, std::numeric_limits<int64_t>::max());
  v.choice("simulator.light_heads", c.simulator.light_heads, kLightHeads);
  v.flag("simulator.wall_observations", c.simulator.wall_observations);
  v.flag("simulator.dynamics.reset_at_standstill", c.simulator.dynamics.reset_at_standstill);
  v.flag("simulator.dynamics.forbid_reversing", c.simulator.dynamics.forbid_reversing);
  for (int i = 0; i < kNumConditioning; ++i) {
    v.range(std::string("simulator.conditioning.") + kConditioningNames[i], c.simulator.conditioning[size_t(i)]);
  }

  v.name("render.backend", c.render.backend, renderer_names());
  v.samples("render.samples", c.render.samples);
  v.text("render.rig", c.render.rig);
  v.integer_unless("render.rig", !c.render.rig.empty(), "render.width_px", c.render.width_px, 1, 8192);
  v.integer_unless("render.rig", !c.render.rig.empty(), "render.height_px", c.render.height_px, 1, 8192);
  v.size_changes("render.schedule", c.render.schedule);
  v.number("render.line_floor_px", c.render.line_floor_px, 0, kMaxLineFloor_px);

  v.choice("policy.modality", c.policy.modality, kModalities);
  v.flag("policy.auxiliary", c.policy.auxiliary);
  v.text("policy.backbone", c.policy.backbone);
  v.flag("policy.backbone_frozen", c.policy.backbone_frozen);
  v.integer("policy.patch_px", c.policy.patch_px, 1, kMaxPatch_px);
  v.integers("policy.conv_channels", c.policy.conv_channels, 1, 4096);
  v.integers("policy.conv_kernels", c.policy.conv_kernels, 1, 31);
  v.integers("policy.conv_strides", c.policy.conv_strides, 1, 16);
  v.integer("policy.num_queries", c.policy.num_queries, 1, 4096);
  v.integer("policy.attention_heads", c.policy.attention_heads, 1, 64);
  v.integer("policy.attention_mlp", c.policy.attention_mlp, 0, 1 << 16);
  v.integer("policy.embedding_width", c.policy.embedding_width, 1, 1 << 14);
  v.flag("policy.point_features", c.policy.point_features);
  v.flag("policy.segment_features", c.policy.segment_features);
  v.flag("policy.goal_features", c.policy.goal_features);
  v.integer("policy.backbone_layers", c.policy.backbone_layers, 1, 64);
  v.integer("policy.backbone_width", c.policy.backbone_width, 1, 1 << 14);
  v.integer("policy.critic_layers", c.policy.critic_layers, 0, 64);
  v.choice("policy.value_head", c.policy.value_head, kValueHeads);
  v.flag("policy.layer_norm", c.policy.layer_norm);
  v.flag("policy.residual", c.policy.residual);
  v.integer("policy.decision_steps", c.policy.decision_steps, 1, 1000);

  v.integer("train.updates", c.train.updates, 1, int64_t{1} << 40);
  v.choice("train.schedule", c.train.schedule, kSchedules);
  v.integer("train.schedule_agent_steps", c.train.schedule_agent_steps, 1, int64_t{1} << 60);
  v.integer("train.decay_agent_steps", c.train.decay_agent_steps, 0, int64_t{1} << 60);
  v.integer("train.warm_up_agent_steps", c.train.warm_up_agent_steps, 0, int64_t{1} << 60);
  v.integer("train.num_steps", c.train.num_steps, 1, 1 << 16);
  v.flag("train.stagger_episodes", c.train.stagger_episodes);
  v.integer("train.minibatch_size", c.train.minibatch_size, 1, int64_t{1} << 32);
  v.integer("train.update_epochs", c.train.update_epochs, 1, 1000);
  v.integer("train.forward_chunk", c.train.forward_chunk, 1, int64_t{1} << 32);
  v.number("train.gamma", c.train.gamma, 0, 1);
  v.number("train.gae_lambda", c.train.gae_lambda, 0, 1);
  v.number("train.clip_coef", c.train.clip_coef, 1e-6, 100);
  v.number("train.vf_coef", c.train.vf_coef, 0, 1e6);
  v.number("train.ent_coef", c.train.ent_coef, 0, 1e6);
  v.choice("train.optimizer", c.train.optimizer, kOptimizers);
  v.number("train.learning_rate", c.train.learning_rate, 0, 100);
  v.number("train.adam_beta1", c.train.adam_beta1, 0, 0.999999);
  v.number("train.adam_beta2", c.train.adam_beta2, 0, 0.99999999);
  v.number("train.adam_eps", c.train.adam_eps, 1e-30, 1);
  v.number("train.weight_decay", c.train.weight_decay, 0, 100);
  v.number("train.max_grad_norm", c.train.max_grad_norm, 1e-9, inf);
  v.number("train.weight_average", c.train.weight_average, 0, 1e9);
  v.integer("train.sharpen_agent_steps", c.train.sharpen_agent_steps, 0, int64_t{1} << 60);
  v.text("train.teacher", c.train.teacher);
  v.number("train.teacher_coef", c.train.teacher_coef, 0, 1e6);
  v.integer("train.teacher_agent_steps", c.train.teacher_agent_steps, 1, int64_t{1} << 60);
  v.flag("train.norm_adv", c.train.norm_adv);
  v.choice("train.adv_filter", c.train.adv_filter, kFilterThresholds);
  v.number("train.adv_filter_threshold", c.train.adv_filter_threshold, 0, 1);
  v.number("train.adv_filter_quantile", c.train.adv_filter_quantile, 0, 0.999);
  v.number("train.adv_filter_ema", c.train.adv_filter_ema, 1e-6, 1);
  v.integer("train.checkpoint_every", c.train.checkpoint_every, 1, int64_t{1} << 40);
  v.number("train.checkpoint_minutes", c.train.checkpoint_minutes, 0.01, 1e6);
  v.integer("train.keep_checkpoints", c.train.keep_checkpoints, 1, 1000);
  v.integer("train.milestone_agent_steps", c.train.milestone_agent_steps, 0, int64_t{1} << 50);
  v.integer("train.evaluate_every", c.train.evaluate_every, 0, int64_t{1} << 40);
  v.integer("train.evaluate_scenarios", c.train.evaluate_scenarios, 1, 1 << 20);
  v.integer("train.evaluate_agents", c.train.evaluate_agents, 1, kMaxAgentsPerWorld);
  v.integer("train.evaluate_steps", c.train.evaluate_steps, 1, 1 << 24);
  v.choice("train.precision", c.train.precision, kPrecisions);
  v.flag("train.reproducible", c.train.reproducible);
  v.name("train.images", c.train.images, {"auto", "kept", "redrawn"});
  v.name("train.graphs", c.train.graphs, {"auto", "off"});
  v.choice("train.halted_slots", c.train.halted_slots, kHaltedSlots);

  for (int i = 0; i < kNumConditioning; ++i) {
    v.number(std::string("evaluate.conditioning.") + kConditioningNames[i], c.evaluate.conditioning[size_t(i)],
             -kMaxConditioning, kMaxConditioning);
  }
}

// Floats are kept as the shortest text that reads back to the same float; so 0.8f is 0.8, not 0.800000011920929.
std::string shortest(float value) { return fmt::format("{}", value); }
std::string shortest(double value) {
  const std::string text = fmt::format("{}", value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

class Reader {
 public:
  /// With `any_name`, names of backends are taken as they are.
  Reader(const toml::table& table, std::string source, const std::set<std::string>& overridden, bool any_name)
      : table_(table), source_(std::move(source)), overridden_(overridden), any_name_(any_name) {}

  template <typename Int>
  void integer(const std::string& key, Int& value, int64_t low, int64_t high) {
    if (const toml::node* node = find(key)) {
      const int64_t number = integer_of(key, *node, low, high);
      value = static_cast<Int>(number);
    }
  }

  /// A key that means nothing once `other` is set, which must have been visited before.
  template <typename Int>
  void integer_unless(const std::string& other, bool is_set, const std::string& key, Int& value, int64_t low,
                      int64_t high) {
    if (find(key) && is_set) refuse(key, fmt::format("has no effect together with {}: leave one of them out", other));
    integer(key, value, low, high);
  }

  void number(const std::string& key, double& value, double low, double high) {
    if (const toml::node* node = find(key)) value = number_of(key, *node, low, high);
  }

  void flag(const std::string& key, bool& value) {
    if (const toml::node* node = find(key)) {
      if (!node->is_boolean()) refuse(key, *node, "expected true or false");
      value = node->as_boolean()->get();
    }
  }

  void text(const std::string& key, std::string& value) {
    if (const toml::node* node = find(key)) value = text_of(key, *node);
  }

  void name(const std::string& key, std::string& value, const std::vector<std::string>& known) {
    const toml::node* node = find(key);
    if (!node) return;
    value = text_of(key, *node);
    if (any_name_ || std::find(known.begin(), known.end(), value) != known.end()) return;
    refuse_name(key, *node, value, known);
  }

  void device(const std::string& key, std::string& value) {
    if (const toml::node* node = find(key)) {
      value = text_of(key, *node);
      if (!is_device(value)) refuse(key, *node, fmt::format("expected one of {}", kDevices));
    }
  }

  void samples(const std::string& key, PixelSamples& value) {
    if (const toml::node* node = find(key)) {
      const std::string text = node->is_integer() ? fmt::format("{}", node->as_integer()->get()) : text_of(key, *node);
      const std::optional<PixelSamples> parsed = parse_pixel_samples(text);
      if (!parsed) refuse(key, *node, fmt::format("expected {}", kPixelSamplesExpected));
      value = *parsed;
    }
  }

  /// The old name of two keys: fills in whichever is absent.
  void old_backend(const std::string& key, std::string& simulator, std::string& renderer) {
    const toml::node* node = find(key);
    if (!node) return;
    const toml::node *new_simulator = find("simulator.backend"), *new_renderer = find("render.backend");
    if (new_simulator && new_renderer) {
      refuse(key, "has no effect together with simulator.backend and render.backend: leave it out");
    }
    std::string its_name;
    name(key, its_name, renderer_names());
    if (!new_renderer) renderer = its_name;
    // Renderers that are no simulators went with the simulator `cpu`.
    if (!new_simulator) simulator = its_name == "cuda" || its_name == "auto" ? its_name : "cpu";
  }

  /// The old measure of the schedule, in updates, each of at most so many agent-steps.
  void old_schedule(const std::string& key, int64_t agent_steps_per_update, int64_t& schedule_agent_steps) {
    if (!find(key)) return;
    if (find("train.schedule_agent_steps")) refuse(key, "has no effect together with train.schedule_agent_steps");
    constexpr int64_t kMost = int64_t{1} << 60;
    int64_t updates = 0;
    integer(key, updates, 1, int64_t{1} << 40);
    schedule_agent_steps = updates > kMost / agent_steps_per_update ? kMost : updates * agent_steps_per_update;
  }

  void texts(const std::string& key, std::vector<std::string>& value) {
    if (const toml::node* node = find(key)) {
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

  /// [[agent_steps, width_px, height_px] or [agent_steps, width_px, height_px, patch_px, line_floor_px], ...]
  void size_changes(const std::string& key, std::vector<Config::Render::SizeChange>& value) {
    const toml::node* node = find(key);
    if (!node) return;
    const std::string expected = fmt::format("expected {}", kSizeChangesExpected);
    if (!node->is_array()) refuse(key, *node, expected);
    value.clear();
    for (const toml::node& element : *node->as_array()) {
      const toml::array* const change = element.as_array();
      if (!change || (change->size() != 3 && change->size() != 5)) refuse(key, *node, expected);
      constexpr int64_t kMostPixels = 8192;
      value.push_back({integer_of(key, (*change)[0], 1, int64_t{1} << 60),
                       static_cast<int>(integer_of(key, (*change)[1], 1, kMostPixels)),
                       static_cast<int>(integer_of(key, (*change)[2], 1, kMostPixels))});
      if (change->size() == 5) {
        value.back().patch_px = static_cast<int>(integer_of(key, (*change)[3], 1, kMaxPatch_px));
        value.back().line_floor_px = number_of(key, (*change)[4], 0, kMaxLineFloor_px);
      }
      if (value.size() > 1 && value.back().agent_steps <= value[value.size() - 2].agent_steps) {
        refuse(key, *node, "expected ascending agent_steps");
      }
    }
  }

  template <typename Enum>
  void choice(const std::string& key, Enum& value, const Choices<Enum>& choices) {
    const toml::node* node = find(key);
    if (!node) return;
    const std::string text = text_of(key, *node);
    std::vector<std::string> known;
    for (const auto& [name, chosen] : choices) {
      if (text == name) return void(value = chosen);
      known.push_back(name);
    }
    refuse_name(key, *node, text, known);
  }

  void range(const std::string& key, ConditioningRange& value) {
    if (const toml::node* node = find(key)) {
      const toml::array& pair = elements_of(key, *node);
      if (pair.size() != 2) refuse(key, *node, "expected [low, high]");
      value.low = static_cast<float>(number_of(key, pair[0], -kMaxConditioning, kMaxConditioning));
      value.high = static_cast<float>(number_of(key, pair[1], -kMaxConditioning, kMaxConditioning));
      if (value.low > value.high) refuse(key, *node, "expected low <= high");
      const bool is_fixed = value.low == value.high;
      if (value.mixture && !(value.low > 0 && (is_fixed || (value.low <= 1 && value.high >= 1)))) {
        refuse(key, *node, "expected 0 < low <= 1 <= high, or low = high > 0");
      }
    }
  }

  /// Throws for the first key of the table that no call read.
  void refuse_unknown(const toml::table& table, const std::string& prefix = "") const {
    for (const auto& [name, node] : table) {
      const std::string key = prefix + std::string(name.str());
      // Of a section that is unknown, its first key is named.
      if (const toml::table* inner = node.as_table(); inner && (sections_.count(key) || !inner->empty()))
        refuse_unknown(*inner, key + ".");
      else if (!known_.count(key))
        refuse_unknown_key(key, node);
    }
  }

  [[noreturn]] void refuse(const std::string& key, const toml::node& node, const std::string& expected) const {
    refuse(key, fmt::format("{}, got {}", expected, shown(node)));
  }
  [[noreturn]] void refuse(const std::string& key, const std::string& message) const {
    if (overridden_.count(key)) fail("--set {}: {}", key, message);
    const toml::node* node = table_.at_path(key).node();
    fail("{}: {}: {}", node ? line_of(*node) : source_, key, message);
  }

 private:
  [[noreturn]] void refuse_name(const std::string& key, const toml::node& node, const std::string& name,
                                const std::vector<std::string>& known) const {
    refuse(key,
           fmt::format("expected one of {}, got {}{}", fmt::join(known, ", "), shown(node), suggestion(name, known)));
  }

  const toml::node* find(const std::string& key) {
    known_.insert(key);
    for (size_t dot = key.find('.'); dot != std::string::npos; dot = key.find('.', dot + 1)) {
      sections_.insert(key.substr(0, dot));
    }
    return table_.at_path(key).node();
  }

  std::string line_of(const toml::node& node) const { return fmt::format("{}:{}", source_, node.source().begin.line); }

  [[noreturn]] void refuse_unknown_key(const std::string& key, const toml::node& node) const {
    if (overridden_.count(key)) fail("--set {}: unknown key{}", key, suggestion_for(key));
    fail("{}: unknown key '{}'{}", line_of(node), key, suggestion_for(key));
  }

  int64_t integer_of(const std::string& key, const toml::node& node, int64_t low, int64_t high) const {
    const std::optional<int64_t> number = whole_number(node);
    if (!number || *number < low || *number > high) {
      refuse(key, node, fmt::format("expected an integer in [{}, {}]", low, high));
    }
    return *number;
  }

  double number_of(const std::string& key, const toml::node& node, double low, double high) const {
    const auto number = node.value<double>();
    if (!number || !(*number >= low && *number <= high)) {
      refuse(key, node, fmt::format("expected a number in [{}, {}]", text_of_number(low), text_of_number(high)));
    }
    return *number;
  }

  static bool is_device(const std::string& text) {
    if (text == "cpu" || text == "cuda" || text == "auto") return true;
    constexpr std::string_view kPrefix = "cuda:";
    constexpr size_t kMaxDigits = 3;
    return text.starts_with(kPrefix) && text.size() > kPrefix.size() && text.size() <= kPrefix.size() + kMaxDigits &&
           text.find_first_not_of("0123456789", kPrefix.size()) == std::string::npos;
  }

  std::string text_of(const std::string& key, const toml::node& node) const {
    if (!node.is_string()) refuse(key, node, "expected a string");
    return node.as_string()->get();
  }

  const toml::array& elements_of(const std::string& key, const toml::node& node) const {
    if (!node.is_array() || node.as_array()->empty()) refuse(key, node, "expected a list with one element or more");
    return *node.as_array();
  }

  // The known key that is nearest, or ends alike, for those who forgot or confused the section.
  std::string suggestion_for(const std::string& key) const {
    const std::vector<std::string> known(known_.begin(), known_.end());
    const std::string last = key.substr(key.rfind('.') + 1);
    for (const std::string& each : known) {
      if (each.substr(each.rfind('.') + 1) == last) return fmt::format("; did you mean '{}'?", each);
    }
    const std::string nearest = suggestion(key, known);
    return nearest.empty() ? "; docs/configuration.md names every key" : nearest;
  }

  const toml::table& table_;
  std::string source_;
  const std::set<std::string>& overridden_;
  bool any_name_;
  std::set<std::string> known_, sections_;
};

class Writer {
 public:
  template <typename Int>
  void integer(const std::string& key, const Int& value, int64_t, int64_t) {
    line(key, fmt::format("{}", value));
  }
  template <typename Int>
  void integer_unless(const std::string&, bool is_set, const std::string& key, const Int& value, int64_t low,
                      int64_t high) {
    if (!is_set) integer(key, value, low, high);
  }
  void number(const std::string& key, const double& value, double, double) { line(key, shortest(value)); }
  void flag(const std::string& key, const bool& value) { line(key, value ? "true" : "false"); }
  void text(const std::string& key, const std::string& value) { line(key, quoted(value)); }
  void name(const std::string& key, const std::string& value, const std::vector<std::string>&) { text(key, value); }
  void device(const std::string& key, const std::string& value) { text(key, value); }
  void samples(const std::string& key, const PixelSamples& value) { text(key, text_of(value)); }
  void texts(const std::string& key, const std::vector<std::string>& values) {
    std::vector<std::string> all;
    for (const std::string& value : values) all.push_back(quoted(value));
    line(key, fmt::format("[{}]", fmt::join(all, ", ")));
  }
  void integers(const std::string& key, const std::vector<int>& values, int64_t, int64_t) {
    line(key, fmt::format("[{}]", fmt::join(values, ", ")));
  }
  void size_changes(const std::string& key, const std::vector<Config::Render::SizeChange>& values) {
    std::vector<std::string> all;
    for (const auto& change : values) {
      all.push_back(fmt::format(
          "[{}, {}, {}{}]", change.agent_steps, change.width_px, change.height_px,
          change.has_patches() ? fmt::format(", {}, {}", change.patch_px, shortest(change.line_floor_px)) : ""));
    }
    line(key, fmt::format("[{}]", fmt::join(all, ", ")));
  }
  template <typename Enum>
  void choice(const std::string& key, const Enum& value, const Choices<Enum>& choices) {
    for (const auto& [name, chosen] : choices) {
      if (chosen == value) text(key, name);
    }
  }
  void range(const std::string& key, const ConditioningRange& value) {
    line(key, fmt::format("[{}, {}]", shortest(value.low), shortest(value.high)));
  }

  std::string toml;                                        // the whole file
  std::vector<std::pair<std::string, std::string>> lines;  // key, value as written

 private:
  static std::string quoted(const std::string& value) {
    std::ostringstream out;
    out << toml::value<std::string>(value);
    return out.str();
  }

  void line(const std::string& key, const std::string& value) {
    const size_t dot = key.rfind('.');
    if (const std::string section = key.substr(0, dot); section != section_) {
      toml += fmt::format("{}[{}]\n", section_.empty() ? "" : "\n", section);
      section_ = section;
    }
    toml += fmt::format("{} = {}\n", key.substr(dot + 1), value);
    lines.emplace_back(key, value);
  }
  std::string section_;
};

// What each key takes and its default, for documents.
class Describer {
 public:
  explicit Describer(const Config& defaults) { visit(defaults, writer_); }

  template <typename Int>
  void integer(const std::string& key, const Int&, int64_t low, int64_t high) {
    add(key, fmt::format("{} to {}", low, high));
  }
  template <typename Int>
  void integer_unless(const std::string& other, bool, const std::string& key, const Int&, int64_t low, int64_t high) {
    add(key, fmt::format("{} to {}, without `{}`", low, high, other));
  }
  void number(const std::string& key, const double&, double low, double high) {
    add(key, std::isinf(high) ? fmt::format("{} or more", text_of_number(low))
                              : fmt::format("{} to {}", text_of_number(low), text_of_number(high)));
  }
  void flag(const std::string& key, const bool&) { add(key, "true, false"); }
  void text(const std::string& key, const std::string&) { add(key, "a text"); }
  void name(const std::string& key, const std::string&, const std::vector<std::string>& known) {
    // Which backends there are depends on the build.
    add(key, key.ends_with(".backend") ? "a backend" : fmt::format("{}", fmt::join(known, ", ")));
  }
  void device(const std::string& key, const std::string&) { add(key, kDevices); }
  void samples(const std::string& key, const PixelSamples&) { add(key, kPixelSamplesExpected); }
  void texts(const std::string& key, const std::vector<std::string>&) { add(key, "a list of texts"); }
  void integers(const std::string& key, const std::vector<int>&, int64_t low, int64_t high) {
    add(key, fmt::format("a list of {} to {}", low, high));
  }
  void size_changes(const std::string& key, const std::vector<Config::Render::SizeChange>&) {
    add(key, fmt::format("{}, in ascending order", kSizeChangesExpected));
  }
  template <typename Enum>
  void choice(const std::string& key, const Enum&, const Choices<Enum>& choices) {
    std::vector<std::string> names;
    for (const auto& [each, chosen] : choices) names.push_back(each);
    add(key, fmt::format("{}", fmt::join(names, ", ")));
  }
  void range(const std::string& key, const ConditioningRange& value) {
    add(key, value.mixture ? "0 < low <= 1 <= high, or low = high > 0"
                           : fmt::format("low <= high, of {} to {}", text_of_number(-kMaxConditioning),
                                         text_of_number(kMaxConditioning)));
  }

  std::vector<ConfigKey> keys;

 private:
  void add(const std::string& key, const std::string& values) {
    const auto line = std::find_if(writer_.lines.begin(), writer_.lines.end(),
                                   [&key](const auto& each) { return each.first == key; });
    keys.push_back({key, line->second, values});
  }
  Writer writer_;
};

// A value of --set: TOML, but numbers as everywhere in the command; what is no TOML is a string, so that run.device=cpu
// works.
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

// "train.updates=2" into the table; "train.updates=" takes the key out of it. Returns the key.
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

// A rig has sizes of its own: named by an override, it takes those of the file out.
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
  for (const Config::Render::SizeChange& change : c.render.schedule) {
    const ImageSize next{change.width_px, change.height_px};
    if (change.has_patches() && c.policy.backbone != "conv") {
      reader.refuse("render.schedule", "patches have no effect with a program in policy.backbone");
    }
    if (change.has_patches() && change.patch_px != patch_px) {
      const int factor = whole_factor(size, next);
      if (factor == 0 || change.patch_px != factor * patch_px) {
        reader.refuse("render.schedule",
                      fmt::format("from {} agent-steps on: expected images and patches that are both one whole number "
                                  "of times {}x{} in patches of {}, got {}x{} in patches of {}",
                                  change.agent_steps, size.width_px, size.height_px, patch_px, next.width_px,
                                  next.height_px, change.patch_px));
      }
      patch_px = change.patch_px;
    }
    size = next;
  }
}

void check_contradictions(const Config& c, const Reader& reader) {
  if (c.simulator.min_agents > c.simulator.max_agents) {
    reader.refuse("simulator.min_agents", fmt::format("expected at most simulator.max_agents ({}), got {}",
                                                      c.simulator.max_agents, c.simulator.min_agents));
  }
  if (c.simulator.pedestrian_fraction + c.simulator.cyclist_fraction > 1) {
    reader.refuse("simulator.pedestrian_fraction",
                  fmt::format("expected at most 1 together with simulator.cyclist_fraction, got {} + {}",
                              c.simulator.pedestrian_fraction, c.simulator.cyclist_fraction));
  }
  const size_t layers = c.policy.conv_channels.size();
  for (const auto& [key, values] : {std::pair{"policy.conv_kernels", &c.policy.conv_kernels},
                                    std::pair{"policy.conv_strides", &c.policy.conv_strides}}) {
    if (values->size() != layers) {
      reader.refuse(key,
                    fmt::format("expected {} values, as policy.conv_channels has, got {}", layers, values->size()));
    }
  }
  if (c.train.num_steps % c.policy.decision_steps != 0) {
    reader.refuse("train.num_steps", fmt::format("expected a multiple of policy.decision_steps ({}), got {}",
                                                 c.policy.decision_steps, c.train.num_steps));
  }
  if (c.policy.decision_steps > 1 && c.train.halted_slots == HaltedSlots::draw) {
    reader.refuse("train.halted_slots", "\"draw\" expects policy.decision_steps = 1");
  }
  for (const int kernel : c.policy.conv_kernels) {
    if (kernel % 2 == 0) reader.refuse("policy.conv_kernels", fmt::format("expected odd sizes, got {}", kernel));
  }
  if (!c.render.schedule.empty() && !c.render.rig.empty()) {
    reader.refuse("render.schedule", "has no effect together with render.rig, whose file gives the sizes");
  }
  if (!c.render.schedule.empty() && !c.reads_images()) {
    reader.refuse("render.schedule", "has no effect with the modality \"vector\", which reads no images");
  }
  if (c.policy.backbone != "conv" && !c.reads_images()) {
    reader.refuse("policy.backbone", "has no effect with the modality \"vector\", which reads no images");
  }
  if (c.policy.backbone == "conv" && c.policy.conv_channels.back() % c.policy.attention_heads != 0) {
    reader.refuse("policy.attention_heads",
                  fmt::format("expected a divisor of the last of policy.conv_channels ({}), got {}",
                              c.policy.conv_channels.back(), c.policy.attention_heads));
  }
  if (c.policy.auxiliary && c.policy.modality == Modality::perspective) {
    reader.refuse("policy.auxiliary", "has no effect with the modality \"perspective\": images have no such slots");
  }
  for (const auto& [key, is_set] : {std::pair{"policy.segment_features", c.policy.segment_features},
                                    std::pair{"policy.goal_features", c.policy.goal_features}}) {
    if (is_set && c.policy.modality == Modality::perspective) {
      reader.refuse(key, "has no effect with the modality \"perspective\", which reads no lists of segments");
    }
  }
  if (c.simulator.wall_observations && c.policy.modality == Modality::perspective) {
    reader.refuse("simulator.wall_observations",
                  "has no effect with the modality \"perspective\": such a policy sees walls in its images");
  }
  if (c.train.decay_agent_steps > c.train.schedule_agent_steps) {
    reader.refuse("train.decay_agent_steps", fmt::format("expected at most train.schedule_agent_steps ({}), got {}",
                                                         c.train.schedule_agent_steps, c.train.decay_agent_steps));
  }
  if (c.train.halted_slots == HaltedSlots::draw && c.train.adv_filter == FilterThreshold::quantile) {
    reader.refuse("train.halted_slots",
                  "\"draw\" takes every transition: expected train.adv_filter = \"maximum\", got \"quantile\"");
  }
  if (c.train.halted_slots == HaltedSlots::draw && c.train.adv_filter_threshold > 0) {
    reader.refuse("train.halted_slots",
                  fmt::format("\"draw\" takes every transition: expected train.adv_filter_threshold = 0, got {}",
                              shortest(c.train.adv_filter_threshold)));
  }
  if (c.render.samples != PixelSamples{} && !c.render.backend.starts_with("gl")) {
    reader.refuse("render.samples", fmt::format("expected one sample with render.backend \"{}\", got {}: only gl takes "
                                                "samples; the others compute exact coverage",
                                                c.render.backend, text_of(c.render.samples)));
  }
}

}  // namespace

std::array<double, kNumConditioning> Config::Evaluate::default_conditioning() {
  // Safe and eager: full penalties, no bias in the lane, goals within 2 m at any speed, unscaled dynamics.
  std::array<double, kNumConditioning> values{};
  auto set = [&](Conditioning which, double value) { values[static_cast<size_t>(which)] = value; };
  set(Conditioning::delta_goal_m, 2);
  set(Conditioning::v_goal_mps, 20);
  set(Conditioning::collision, 3);
  set(Conditioning::off_road, 3);
  set(Conditioning::stop_line, 1);
  set(Conditioning::comfort, 0.05);
  set(Conditioning::lane_align, 2.5e-2);
  set(Conditioning::vel_align, 1);
  set(Conditioning::lane_center, 7.5e-3);
  set(Conditioning::center_bias_m, 0);
  set(Conditioning::velocity, 2.5e-3);
  set(Conditioning::reverse, 7.5e-3);
  set(Conditioning::overspeed, 0.05);
  set(Conditioning::timestep, 2.5e-5);
  set(Conditioning::throttle, 1);
  set(Conditioning::steer, 1);
  set(Conditioning::acceleration, 1);
  return values;
}

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
  reader.refuse_unknown(table);
  try {
    config.simulator.maps = expand_map_names(config.simulator.maps);
  } catch (const UsageError& error) {
    reader.refuse("simulator.maps", error.what());
  }
  check_contradictions(config, reader);
  // What a run saves has the sizes that are in force, which the rows of the schedule before do not lead to.
  if (!any_name) check_patch_changes(config, reader);
  // Earlier versions took it without a word, so what they saved may hold it.
  if (!any_name && config.simulator.min_agents > config.simulator.num_slots) {
    reader.refuse("simulator.min_agents", fmt::format("expected at most simulator.num_slots ({}), got {}",
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
  const auto beside_config = [&path](std::string* file_inout) {
    const std::filesystem::path file(*file_inout);
    if (file.empty() || file.is_absolute()) return;
    *file_inout = (std::filesystem::path(path).parent_path() / file).lexically_normal().string();
  };
  if (!is_overridden("render.rig")) beside_config(&config.render.rig);
  if (config.policy.backbone != "conv" && !is_overridden("policy.backbone")) beside_config(&config.policy.backbone);
  if (!is_overridden("train.teacher")) beside_config(&config.train.teacher);
  if (!is_overridden("simulator.maps")) {
    for (std::string& map : config.simulator.maps) {
      if (is_map_file(map)) beside_config(&map);
    }
  }
  return config;
}

Config with_absolute_paths(Config config) {
  const auto make_absolute = [](std::string* file_inout) {
    *file_inout = std::filesystem::absolute(*file_inout).lexically_normal().string();
  };
  if (!config.render.rig.empty()) make_absolute(&config.render.rig);
  if (config.policy.backbone != "conv") make_absolute(&config.policy.backbone);
  if (!config.train.teacher.empty()) make_absolute(&config.train.teacher);
  for (std::string& map : config.simulator.maps) {
    if (is_map_file(map)) make_absolute(&map);
  }
  return config;
}

std::vector<ConfigKey> config_keys() {
  const Config defaults;
  Describer describer(defaults);
  visit(defaults, describer);
  return describer.keys;
}

std::vector<std::string> idle_settings(const Config& config) {
  std::vector<std::string> notices;
  const int64_t rollout = int64_t{config.simulator.num_slots} * config.train.num_steps;
  if (config.train.minibatch_size > rollout) {
    notices.push_back(
        fmt::format("train.minibatch_size: {} are more than the transitions of a rollout (simulator."
                    "num_slots x train.num_steps = {}): each epoch is one minibatch",
                    config.train.minibatch_size, rollout));
  }
  return notices;
}

std::string to_toml(const Config& config) {
  Writer writer;
  visit(config, writer);
  return writer.toml;
}

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

}  // namespace

namespace {

// "KEY: OLD became NEW" of each key that the predicate has and in which the two differ.
template <typename Predicate>
std::vector<std::string> differences(const Config& saved, const Config& now, const Predicate& counts,
                                     const char* between = "became") {
  Writer before, after;
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
  Writer writer;
  visit(config, writer);
  std::map<std::string, std::string> keys;
  for (const auto& [key, value] : writer.lines) {
    const bool is_of_world = key.starts_with("simulator.") && !key.starts_with("simulator.conditioning.");
    const bool is_of_policy = key.starts_with("policy.") || key == "render.line_floor_px";
    if ((is_of_world || (has_policy && is_of_policy)) && !kReplaced.contains(key)) keys[key] = value;
  }
  return keys;
}

bool Config::reads(ObservationPart part) const {
  return part == ObservationPart::own ||
         (policy.modality == Modality::vector && (part != ObservationPart::walls || simulator.wall_observations));
}

namespace {

template <typename Enum>
std::string name_among(const Choices<Enum>& choices, Enum value) {
  return std::find_if(choices.begin(), choices.end(), [&](const auto& choice) { return choice.second == value; })
      ->first;
}

}  // namespace

std::string name_of(Precision precision) { return name_among(kPrecisions, precision); }
std::string name_of(OptimizerKind kind) { return name_among(kOptimizers, kind); }
std::string name_of(ValueHead head) { return name_among(kValueHeads, head); }

Config config_at(const Config& config, int64_t agent_steps) {
  Config result = config;
  for (const Config::Render::SizeChange& change : config.render.schedule) {
    if (change.agent_steps > agent_steps) break;
    result.render.width_px = change.width_px;
    result.render.height_px = change.height_px;
    if (!change.has_patches()) continue;
    result.policy.patch_px = change.patch_px;
    result.render.line_floor_px = change.line_floor_px;
  }
  return result;
}

int whole_factor(ImageSize from, ImageSize to) {
  const int factor = to.width_px / from.width_px;
  return to == ImageSize{factor * from.width_px, factor * from.height_px} ? factor : 0;
}

Rig rig_of(const Config& config, int64_t agent_steps) {
  if (!config.render.rig.empty()) return load_rig(config.render.rig);
  const Config in_force = config_at(config, agent_steps);
  return paper_rig(in_force.render.width_px, in_force.render.height_px);
}

RendererConfig renderer_config(const Config& config, const Rig& rig, Device device) {
  RendererConfig result;
  result.device = device;
  result.rig = rig;
  result.num_threads = config.run.num_threads;
  result.line_floor_px = static_cast<float>(config.render.line_floor_px);
  result.samples = config.render.samples;
  return result;
}

SimulatorConfig simulator_config(const Config& config, Device device) {
  SimulatorConfig result;
  result.device = device;
  result.seed = config.run.seed;
  result.num_threads = config.run.num_threads;
  result.episode_steps = config.simulator.episode_steps;
  result.reset_inactive_fraction = static_cast<float>(config.simulator.reset_inactive_fraction);
  result.stagger_episodes = config.train.stagger_episodes;
  result.pedestrian_fraction = static_cast<float>(config.simulator.pedestrian_fraction);
  result.cyclist_fraction = static_cast<float>(config.simulator.cyclist_fraction);
  result.parked_cars = config.simulator.parked_cars;
  result.light_cycles = config.simulator.light_cycles;
  result.dynamics = config.simulator.dynamics;
  result.walls = config.simulator.walls;
  result.wall_seed = config.simulator.wall_seed;
  result.light_heads = config.simulator.light_heads;
  result.auxiliary_observations = config.policy.modality == Modality::vector && config.policy.auxiliary;
  result.vector_observations = config.policy.modality == Modality::vector;
  result.wall_observations = config.simulator.wall_observations;
  result.conditioning = config.simulator.conditioning;
  return result;
}

SimulatorConfig evaluation_simulator_config(const Config& config, int steps, Device device) {
  SimulatorConfig result = simulator_config(config, device);
  result.episode_steps = steps;
  result.reset_inactive_fraction = 2;
  result.stagger_episodes = false;
  result.fixed_lights = true;
  for (size_t i = 0; i < result.conditioning.size(); ++i) {
    const auto value = static_cast<float>(config.evaluate.conditioning[i]);
    result.conditioning[i] = {value, value, false};
  }
  return result;
}

}  // namespace pictura
