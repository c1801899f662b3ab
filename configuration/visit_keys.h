// The list of keys of the configuration: what reads, writes, compares and describes them walks it.
#pragma once

#include <iterator>
#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/configuration/config.h"
#include "pictura/map/map_copy.h"
#include "pictura/simulator/conditioning_lookup.h"

namespace pictura {

// Names of choices, in the order of their enums.
using Names = std::vector<std::string>;
inline const Names kModalities{"perspective", "vector"};
inline const Names kPrecisions{"fp32", "tf32", "bf16"};
inline const Names kSchedules{"constant", "linear", "cosine"};
inline const Names kOptimizers{"adamw", "muon"};
inline const Names kValueHeads{"linear", "symlog", "two_hot"};
inline const Names kFilterThresholds{"maximum", "quantile"};
inline const Names kLightCycles{std::begin(kLightCyclesNames), std::end(kLightCyclesNames)};
inline const Names kLightHeads{kLightHeadsNames.begin(), kLightHeadsNames.end()};
inline const Names kHaltedSlots{"skip", "draw"};

inline constexpr const char* kDevices = "cpu, cuda, cuda:N, auto";
inline constexpr const char* kSizeChangesExpected =
    "a list of [agent_steps, width_px, height_px] or [agent_steps, width_px, height_px, patch_px, line_floor_px]";

/// What a run that goes on may change of a key: nothing; its value, without a word; or its value, with a notice.
enum class Resume { fixed, free, reported };

/// Whether an evaluation counts by a key's value, where its section matters to evaluations at all, or by an option of
/// its own in its place.
enum class Evaluation { counts, replaced };

/// A key and what is to be said of it beside its type, default and range.
struct NamedKey {
  NamedKey(const char* its_name) : name(its_name) {}                // NOLINT: most keys are a name alone
  NamedKey(std::string its_name, Resume at_resume = Resume::fixed,  // NOLINT
           Evaluation in_evaluation = Evaluation::counts)
      : name(std::move(its_name)), resume(at_resume), evaluation(in_evaluation) {}
  operator const std::string&() const { return name; }  // NOLINT: most visitors need no more

  std::string name;
  Resume resume = Resume::fixed;
  Evaluation evaluation = Evaluation::counts;
};

// The list of keys, in the order in which they are written. Reader and writer both walk it, so no key can be read and
// not written. A visitor takes (key, value, range...).
template <typename AnyConfig, typename Visitor>
void visit(AnyConfig& c, Visitor&& v) {
  const double inf = std::numeric_limits<double>::infinity();
  v.integer("run.seed", c.run.seed, 0, std::numeric_limits<int64_t>::max());
  v.integer(NamedKey{"run.num_threads", Resume::free}, c.run.num_threads, 0, kMaxThreads);
  v.device(NamedKey{"run.device", Resume::free}, c.run.device);

  v.name(NamedKey{"simulator.backend", Resume::free, Evaluation::replaced}, c.simulator.backend, simulator_names());
  v.texts(NamedKey{"simulator.maps", Resume::fixed, Evaluation::replaced}, c.simulator.maps);
  v.integer(NamedKey{"simulator.map_copies", Resume::fixed, Evaluation::replaced}, c.simulator.map_copies, 0,
            kMaxMapCopies);
  v.integer(NamedKey{"simulator.num_slots", Resume::reported, Evaluation::replaced}, c.simulator.num_slots, 1, 1 << 22);
  v.integer(NamedKey{"simulator.min_agents", Resume::fixed, Evaluation::replaced}, c.simulator.min_agents, 1,
            kMaxAgentsPerWorld);
  v.integer(NamedKey{"simulator.max_agents", Resume::fixed, Evaluation::replaced}, c.simulator.max_agents, 1,
            kMaxAgentsPerWorld);
  v.integer(NamedKey{"simulator.episode_steps", Resume::fixed, Evaluation::replaced}, c.simulator.episode_steps, 1,
            1 << 24);
  v.number(NamedKey{"simulator.reset_inactive_fraction", Resume::fixed, Evaluation::replaced},
           c.simulator.reset_inactive_fraction, 1e-6, 2);
  v.number("simulator.pedestrian_fraction", c.simulator.pedestrian_fraction, 0, 1);
  v.number("simulator.cyclist_fraction", c.simulator.cyclist_fraction, 0, 1);
  v.integer("simulator.parked_cars", c.simulator.parked_cars, 0, kMaxAgentsPerWorld);
  v.choice(NamedKey{"simulator.light_cycles", Resume::fixed, Evaluation::replaced}, c.simulator.light_cycles,
           kLightCycles);
  v.flag("simulator.walls", c.simulator.walls);
  v.integer("simulator.wall_seed", c.simulator.wall_seed, 0, std::numeric_limits<int64_t>::max());
  v.choice(NamedKey{"simulator.light_heads", Resume::fixed, Evaluation::replaced}, c.simulator.light_heads,
           kLightHeads);
  v.flag("simulator.wall_observations", c.simulator.wall_observations);
  v.flag("simulator.dynamics.reset_at_standstill", c.simulator.dynamics.reset_at_standstill);
  v.flag("simulator.dynamics.forbid_reversing", c.simulator.dynamics.forbid_reversing);
  for (int i = 0; i < kNumConditioning; ++i) {
    v.range(std::string("simulator.conditioning.") + kConditioningNames[i], c.simulator.conditioning[size_t(i)]);
  }

  v.name("render.backend", c.render.backend, renderer_names());
  v.samples("render.samples", c.render.samples);
  v.text(NamedKey{"render.rig", Resume::free}, c.render.rig);
  v.integer_unless("render.rig", !c.render.rig.empty(), NamedKey{"render.width_px", Resume::free}, c.render.width_px, 1,
                   8192);
  v.integer_unless("render.rig", !c.render.rig.empty(), NamedKey{"render.height_px", Resume::free}, c.render.height_px,
                   1, 8192);
  v.size_changes(NamedKey{"render.schedule", Resume::reported}, c.render.schedule);
  v.number("render.line_floor_px", c.render.line_floor_px, 0, kMaxLineFloor_px);

  v.choice("policy.modality", c.policy.modality, kModalities);
  v.flag("policy.auxiliary", c.policy.auxiliary);
  v.text(NamedKey{"policy.backbone", Resume::free, Evaluation::replaced}, c.policy.backbone);
  v.flag(NamedKey{"policy.backbone_frozen", Resume::fixed, Evaluation::replaced}, c.policy.backbone_frozen);
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

  v.integer(NamedKey{"train.updates", Resume::free}, c.train.updates, 1, int64_t{1} << 40);
  v.choice(NamedKey{"train.schedule", Resume::reported}, c.train.schedule, kSchedules);
  v.integer(NamedKey{"train.schedule_agent_steps", Resume::reported}, c.train.schedule_agent_steps, 1,
            int64_t{1} << 60);
  v.integer(NamedKey{"train.decay_agent_steps", Resume::reported}, c.train.decay_agent_steps, 0, int64_t{1} << 60);
  v.integer(NamedKey{"train.warm_up_agent_steps", Resume::reported}, c.train.warm_up_agent_steps, 0, int64_t{1} << 60);
  v.integer("train.num_steps", c.train.num_steps, 1, 1 << 16);
  v.flag("train.stagger_episodes", c.train.stagger_episodes);
  v.integer(NamedKey{"train.minibatch_size", Resume::reported}, c.train.minibatch_size, 1, int64_t{1} << 32);
  v.integer(NamedKey{"train.update_epochs", Resume::reported}, c.train.update_epochs, 1, 1000);
  v.integer(NamedKey{"train.forward_chunk", Resume::free}, c.train.forward_chunk, 1, int64_t{1} << 32);
  v.number(NamedKey{"train.gamma", Resume::reported}, c.train.gamma, 0, 1);
  v.number(NamedKey{"train.gae_lambda", Resume::reported}, c.train.gae_lambda, 0, 1);
  v.number("train.clip_coef", c.train.clip_coef, 1e-6, 100);
  v.number("train.vf_coef", c.train.vf_coef, 0, 1e6);
  v.number(NamedKey{"train.ent_coef", Resume::reported}, c.train.ent_coef, 0, 1e6);
  v.choice(NamedKey{"train.optimizer", Resume::free}, c.train.optimizer, kOptimizers);
  v.number(NamedKey{"train.learning_rate", Resume::reported}, c.train.learning_rate, 0, 100);
  v.number("train.adam_beta1", c.train.adam_beta1, 0, 0.999999);
  v.number("train.adam_beta2", c.train.adam_beta2, 0, 0.99999999);
  v.number("train.adam_eps", c.train.adam_eps, 1e-30, 1);
  v.number("train.weight_decay", c.train.weight_decay, 0, 100);
  v.number("train.max_grad_norm", c.train.max_grad_norm, 1e-9, inf);
  v.number(NamedKey{"train.weight_average", Resume::reported}, c.train.weight_average, 0, 1e9);
  v.integer(NamedKey{"train.sharpen_agent_steps", Resume::reported}, c.train.sharpen_agent_steps, 0, int64_t{1} << 60);
  v.text(NamedKey{"train.teacher", Resume::reported}, c.train.teacher);
  v.number(NamedKey{"train.teacher_coef", Resume::reported}, c.train.teacher_coef, 0, 1e6);
  v.integer(NamedKey{"train.teacher_agent_steps", Resume::reported}, c.train.teacher_agent_steps, 1, int64_t{1} << 60);
  v.flag("train.norm_adv", c.train.norm_adv);
  v.choice("train.adv_filter", c.train.adv_filter, kFilterThresholds);
  v.number("train.adv_filter_threshold", c.train.adv_filter_threshold, 0, 1);
  v.number("train.adv_filter_quantile", c.train.adv_filter_quantile, 0, 0.999);
  v.number("train.adv_filter_ema", c.train.adv_filter_ema, 1e-6, 1);
  v.integer(NamedKey{"train.checkpoint_every", Resume::free}, c.train.checkpoint_every, 1, int64_t{1} << 40);
  v.number(NamedKey{"train.checkpoint_minutes", Resume::free}, c.train.checkpoint_minutes, 0.01, 1e6);
  v.integer(NamedKey{"train.keep_checkpoints", Resume::free}, c.train.keep_checkpoints, 1, 1000);
  v.integer(NamedKey{"train.milestone_agent_steps", Resume::free}, c.train.milestone_agent_steps, 0, int64_t{1} << 50);
  v.integer(NamedKey{"train.evaluate_every", Resume::free}, c.train.evaluate_every, 0, int64_t{1} << 40);
  v.integer(NamedKey{"train.evaluate_scenarios", Resume::free}, c.train.evaluate_scenarios, 1, 1 << 20);
  v.integer(NamedKey{"train.evaluate_agents", Resume::free}, c.train.evaluate_agents, 1, kMaxAgentsPerWorld);
  v.integer(NamedKey{"train.evaluate_steps", Resume::free}, c.train.evaluate_steps, 1, 1 << 24);
  v.choice("train.precision", c.train.precision, kPrecisions);
  v.flag(NamedKey{"train.reproducible", Resume::reported}, c.train.reproducible);
  v.name(NamedKey{"train.images", Resume::free}, c.train.images, {"auto", "kept", "redrawn"});
  v.name(NamedKey{"train.graphs", Resume::free}, c.train.graphs, {"auto", "off"});
  v.choice(NamedKey{"train.halted_slots", Resume::free}, c.train.halted_slots, kHaltedSlots);

  for (int i = 0; i < kNumConditioning; ++i) {
    v.number(NamedKey{std::string("evaluate.conditioning.") + kConditioningNames[i], Resume::free},
             c.evaluate.conditioning[size_t(i)], -kMaxConditioning, kMaxConditioning);
  }
}

}  // namespace pictura
