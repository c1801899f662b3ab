// The list of keys of the configuration: what reads, writes, compares and describes them walks it.
#pragma once

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

template <typename Enum>
using Choices = std::vector<std::pair<std::string, Enum>>;
inline const Choices<Modality> kModalities{{"perspective", Modality::perspective}, {"vector", Modality::vector}};
inline const Choices<Precision> kPrecisions{
    {"fp32", Precision::fp32}, {"tf32", Precision::tf32}, {"bf16", Precision::bf16}};
inline const Choices<Schedule> kSchedules{
    {"constant", Schedule::constant}, {"linear", Schedule::linear}, {"cosine", Schedule::cosine}};
inline const Choices<OptimizerKind> kOptimizers{{"adamw", OptimizerKind::adamw}, {"muon", OptimizerKind::muon}};
inline const Choices<ValueHead> kValueHeads{
    {"linear", ValueHead::linear}, {"symlog", ValueHead::symlog}, {"two_hot", ValueHead::two_hot}};
inline const Choices<FilterThreshold> kFilterThresholds{{"maximum", FilterThreshold::maximum},
                                                        {"quantile", FilterThreshold::quantile}};
inline const Choices<LightCycles> kLightCycles{{name_of(LightCycles::phases), LightCycles::phases},
                                               {name_of(LightCycles::independent), LightCycles::independent}};
inline const Choices<LightHeads> kLightHeads{{name_of(LightHeads::as_mapped), LightHeads::as_mapped},
                                             {name_of(LightHeads::visible), LightHeads::visible}};
inline const Choices<HaltedSlots> kHaltedSlots{{"skip", HaltedSlots::skip}, {"draw", HaltedSlots::draw}};

inline constexpr const char* kDevices = "cpu, cuda, cuda:N, auto";
inline constexpr const char* kSizeChangesExpected =
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

}  // namespace pictura
