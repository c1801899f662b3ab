// List of the configuration's keys. Reading, writing, comparison and documentation visit it.
#pragma once

#include <array>
#include <limits>
#include <string>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/support/named_option.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/configuration/config.h"
#include "pictura/map/map_copy.h"
#include "pictura/simulator/conditioning_lookup.h"
#include "pictura/simulator/simulator_options.h"

namespace pictura {

// Names of enumerators, in the order of their enums.
inline constexpr std::array kModalities{"perspective", "vector"};
inline constexpr std::array kPrecisions{"fp32", "tf32", "bf16"};
inline constexpr std::array kSchedules{"constant", "linear", "cosine"};
inline constexpr std::array kOptimizers{"adamw", "muon"};
inline constexpr std::array kFilterThresholds{"maximum", "quantile"};
inline constexpr std::array kHaltedSlots{"skip", "draw"};

inline constexpr const char* kSizeChangesExpected =
    "a list of [agent_steps, width_px, height_px] or [agent_steps, width_px, height_px, patch_px, line_floor_px]";

// Visits all keys in the order of to_toml(). The visitor's members take (key, value, range...).
template <typename AnyConfig, typename Visitor>
void visit(AnyConfig& c, Visitor&& v) {
  const double inf = std::numeric_limits<double>::infinity();
  v.value("run.seed", c.run.seed, 0, std::numeric_limits<int64_t>::max());
  v.value(NamedKey{"run.num_threads", Resume::free}, c.run.num_threads, 0, kMaxThreads);
  v.device(NamedKey{"run.device", Resume::free}, c.run.device);

  v.name(NamedKey{"simulator.backend", Resume::free, Evaluation::replaced}, c.simulator.backend, simulator_names());
  v.texts(NamedKey{"simulator.maps", Evaluation::replaced}, c.simulator.maps);
  v.value(NamedKey{"simulator.map_copies", Evaluation::replaced}, c.simulator.map_copies, 0, kMaxMapCopies);
  v.value(NamedKey{"simulator.num_slots", Resume::reported, Evaluation::replaced}, c.simulator.num_slots, 1, 1 << 22);
  v.value(NamedKey{"simulator.min_agents", Evaluation::replaced}, c.simulator.min_agents, 1, kMaxAgentsPerWorld);
  v.value(NamedKey{"simulator.max_agents", Evaluation::replaced}, c.simulator.max_agents, 1, kMaxAgentsPerWorld);
  visit_simulator_keys(c.simulator, v);
  v.texts(NamedKey{"simulator.others.policies", Resume::reported, Evaluation::replaced}, c.simulator.other_policies);
  v.name(NamedKey{"simulator.scenes.protocol", Evaluation::replaced}, c.simulator.scenes.protocol,
         scene_protocol_names());
  v.value(NamedKey{"simulator.scenes.control", Evaluation::replaced}, c.simulator.scenes.control);
  v.texts(NamedKey{"simulator.scenes.rules", Evaluation::replaced}, c.simulator.scenes.rules);
  v.value(NamedKey{"simulator.scenes.max_replayed", Evaluation::replaced}, c.simulator.scenes.max_replayed, 0,
          kMaxAgentsPerWorld);
  v.value(NamedKey{"simulator.scenes.updates_per_set", Resume::reported, Evaluation::replaced},
          c.simulator.scenes.updates_per_set, 1, int64_t{1} << 40);
  for (int i = 0; i < kNumConditioning; ++i) {
    v.range(std::string("simulator.conditioning.") + kConditioningNames[i], c.simulator.conditioning[size_t(i)]);
  }

  v.name("render.backend", c.render.backend, renderer_names());
  v.samples("render.samples", c.render.samples);
  v.value(NamedKey{"render.rig", Resume::free}, c.render.rig);
  v.value_unless("render.rig", !c.render.rig.empty(), NamedKey{"render.width_px", Resume::free}, c.render.width_px, 1,
                 8192);
  v.value_unless("render.rig", !c.render.rig.empty(), NamedKey{"render.height_px", Resume::free}, c.render.height_px, 1,
                 8192);
  v.size_changes(NamedKey{"render.schedule", Resume::reported}, c.render.schedule);
  v.value("render.line_floor_px", c.render.line_floor_px, 0, kMaxLineFloor_px);
  const auto randomization = [&v](const char* name, auto& range, double highest) {
    v.value(NamedKey{std::string("render.randomization.") + name, Resume::reported}, range, 0, highest);
  };
  constexpr CameraRandomization kMax = kMaxCameraRandomization;
  randomization("rotation_deg", c.render.randomization.rotation_deg, kMax.rotation_deg);
  randomization("shift_m", c.render.randomization.shift_m, kMax.shift_m);
  randomization("focal_share", c.render.randomization.focal_share, kMax.focal_share);
  randomization("brightness_share", c.render.randomization.brightness_share, kMax.brightness_share);
  randomization("noise_share", c.render.randomization.noise_share, kMax.noise_share);
  randomization("dead_probability", c.render.randomization.dead_probability, kMax.dead_probability);
  randomization("dropped_probability", c.render.randomization.dropped_probability, kMax.dropped_probability);

  v.choice("policy.modality", c.policy.modality, kModalities);
  v.value("policy.auxiliary", c.policy.auxiliary);
  v.value(NamedKey{"policy.backbone", Resume::free, Evaluation::replaced}, c.policy.backbone);
  v.value(NamedKey{"policy.backbone_frozen", Evaluation::replaced}, c.policy.backbone_frozen);
  v.value("policy.patch_px", c.policy.patch_px, 1, kMaxPatch_px);
  v.integers("policy.conv_channels", c.policy.conv_channels, 1, PolicySection::kMaxConvChannels);
  v.integers("policy.conv_kernels", c.policy.conv_kernels, 1, 31);
  v.integers("policy.conv_strides", c.policy.conv_strides, 1, 16);
  v.value("policy.num_queries", c.policy.num_queries, 1, 4096);
  v.value("policy.concatenate_queries", c.policy.concatenate_queries);
  v.value("policy.attention_heads", c.policy.attention_heads, 1, 64);
  v.value("policy.attention_mlp", c.policy.attention_mlp, 0, 1 << 16);
  v.value("policy.embedding_width", c.policy.embedding_width, 1, 1 << 14);
  v.value("policy.point_features", c.policy.point_features);
  v.value("policy.segment_features", c.policy.segment_features);
  v.value("policy.backbone_layers", c.policy.backbone_layers, 1, 64);
  v.value("policy.backbone_width", c.policy.backbone_width, 1, 1 << 14);
  v.value("policy.layer_norm", c.policy.layer_norm);
  v.value("policy.conv_norm", c.policy.conv_norm);
  v.value("policy.residual", c.policy.residual);
  v.value("policy.decision_steps", c.policy.decision_steps, 1, kMaxDecisionSteps);

  v.value(NamedKey{"train.updates", Resume::free}, c.train.updates, 1, int64_t{1} << 40);
  v.choice(NamedKey{"train.schedule", Resume::reported}, c.train.schedule, kSchedules);
  v.value(NamedKey{"train.schedule_agent_steps", Resume::reported}, c.train.schedule_agent_steps, 1, int64_t{1} << 60);
  v.value(NamedKey{"train.decay_agent_steps", Resume::reported}, c.train.decay_agent_steps, 0, int64_t{1} << 60);
  v.value(NamedKey{"train.warm_up_agent_steps", Resume::reported}, c.train.warm_up_agent_steps, 0, int64_t{1} << 60);
  v.value("train.num_steps", c.train.num_steps, 1, 1 << 16);
  v.value("train.stagger_episodes", c.train.stagger_episodes);
  v.value(NamedKey{"train.minibatch_size", Resume::reported}, c.train.minibatch_size, 1, int64_t{1} << 32);
  v.value(NamedKey{"train.update_epochs", Resume::reported}, c.train.update_epochs, 1, 1000);
  v.value(NamedKey{"train.forward_chunk", Resume::free}, c.train.forward_chunk, 1, int64_t{1} << 32);
  v.value(NamedKey{"train.gamma", Resume::reported}, c.train.gamma, 0, 1);
  v.value(NamedKey{"train.gae_lambda", Resume::reported}, c.train.gae_lambda, 0, 1);
  v.value("train.clip_coef", c.train.clip_coef, 1e-6, 100);
  v.value(NamedKey{"train.policy_coef", Resume::reported}, c.train.policy_coef, 0, 1e6);
  v.value("train.vf_coef", c.train.vf_coef, 0, 1e6);
  v.value(NamedKey{"train.ent_coef", Resume::reported}, c.train.ent_coef, 0, 1e6);
  v.choice(NamedKey{"train.optimizer", Resume::free}, c.train.optimizer, kOptimizers);
  v.value(NamedKey{"train.learning_rate", Resume::reported}, c.train.learning_rate, 0, 100);
  v.value("train.adam_beta1", c.train.adam_beta1, 0, 0.999999);
  v.value("train.adam_beta2", c.train.adam_beta2, 0, 0.99999999);
  v.value("train.adam_eps", c.train.adam_eps, 1e-30, 1);
  v.value("train.weight_decay", c.train.weight_decay, 0, 100);
  v.value("train.max_grad_norm", c.train.max_grad_norm, 1e-9, inf);
  v.value(NamedKey{"train.weight_average", Resume::reported}, c.train.weight_average, 0, 1e9);
  v.value(NamedKey{"train.sharpen_agent_steps", Resume::reported}, c.train.sharpen_agent_steps, 0, int64_t{1} << 60);
  v.value(NamedKey{"train.teacher", Resume::reported}, c.train.teacher);
  v.value(NamedKey{"train.teacher_coef", Resume::reported}, c.train.teacher_coef, 0, 1e6);
  v.value(NamedKey{"train.teacher_agent_steps", Resume::reported}, c.train.teacher_agent_steps, 1, int64_t{1} << 60);
  v.value(NamedKey{"train.teacher_scene_coef", Resume::reported}, c.train.teacher_scene_coef, 0, 1e6);
  v.value("train.norm_adv", c.train.norm_adv);
  v.choice("train.adv_filter", c.train.adv_filter, kFilterThresholds);
  v.value("train.adv_filter_threshold", c.train.adv_filter_threshold, 0, 1);
  v.value("train.adv_filter_quantile", c.train.adv_filter_quantile, 0, 0.999);
  v.value("train.adv_filter_ema", c.train.adv_filter_ema, 1e-6, 1);
  v.value(NamedKey{"train.checkpoint_every", Resume::free}, c.train.checkpoint_every, 1, int64_t{1} << 40);
  v.value(NamedKey{"train.checkpoint_minutes", Resume::free}, c.train.checkpoint_minutes, 0.01, 1e6);
  v.value(NamedKey{"train.keep_checkpoints", Resume::free}, c.train.keep_checkpoints, 1, 1000);
  v.value(NamedKey{"train.milestone_agent_steps", Resume::free}, c.train.milestone_agent_steps, 0, int64_t{1} << 50);
  v.value(NamedKey{"train.evaluate_every", Resume::free}, c.train.evaluate_every, 0, int64_t{1} << 40);
  v.value(NamedKey{"train.evaluate_scenarios", Resume::free}, c.train.evaluate_scenarios, 1, 1 << 20);
  v.value(NamedKey{"train.evaluate_agents", Resume::free}, c.train.evaluate_agents, 1, kMaxAgentsPerWorld);
  v.value(NamedKey{"train.evaluate_steps", Resume::free}, c.train.evaluate_steps, 1, 1 << 24);
  v.choice("train.precision", c.train.precision, kPrecisions);
  v.value(NamedKey{"train.reproducible", Resume::reported}, c.train.reproducible);
  v.name(NamedKey{"train.images", Resume::free}, c.train.images, {"auto", "kept", "redrawn"});
  v.name(NamedKey{"train.graphs", Resume::free}, c.train.graphs, {"auto", "off"});
  v.choice(NamedKey{"train.halted_slots", Resume::free}, c.train.halted_slots, kHaltedSlots);

  for (int i = 0; i < kNumConditioning; ++i) {
    v.value(NamedKey{std::string("evaluate.conditioning.") + kConditioningNames[i], Resume::free},
            c.evaluate.conditioning[size_t(i)], -kMaxConditioning, kMaxConditioning);
  }
}

}  // namespace pictura
