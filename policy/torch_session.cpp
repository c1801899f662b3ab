// Sessions in which torch computes the policy.
#include <ATen/Parallel.h>
#include <c10/core/StreamGuard.h>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/policy/decision_clock.h"
#include "pictura/policy/observation.h"
#include "pictura/policy/precision.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/policy/session_parts.h"
#include "pictura/policy/torch_device.h"
#include "pictura/simulator/controllers/host_controllers.h"

namespace pictura {

namespace {

Config with_seed(Config config, uint64_t seed) {
  config.run.seed = seed;
  return config;
}

// Returns the configuration without randomization of cameras.
Config as_mounted(Config config) {
  config.render.randomization = {};
  return config;
}

struct TorchSession final : SessionParts {
  /// its_policy: a policy that another object owns, or null. If null, this object creates the policy, with weights from
  /// the configuration's seed.
  TorchSession(const Config& its_config, Device its_device, const Rig& its_rig, double its_camera_severity,
               const Policy* its_policy = nullptr)
      : SessionParts(its_config, its_device, its_rig, its_camera_severity),
        executor(make_policy_executor(device)),
        own_policy(its_policy ? nullptr : make_policy(config, rig, device)),
        policy(its_policy ? *its_policy : *own_policy) {}

  std::string policy_hash() const override { return policy.hash(); }

  std::unique_ptr<SessionParts> make_untrained(uint64_t seed) const override {
    return std::make_unique<TorchSession>(with_seed(config, seed), device, rig, camera_severity);
  }

  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out,
                Span<float> values_out) const override {
    const c10::OptionalStreamGuard guard(torch_stream({}, device));
    const auto batch = static_cast<int64_t>(values_out.size());
    const at::Tensor all = at::arange(batch, at::TensorOptions(at::kLong).device(torch_device(device)));
    const Decision decision = decide(input, batch, all, renderer);
    tensor_over(logits_out, device, {batch, kNumActions}).copy_(decision.logits);
    tensor_over(values_out, device, {batch}).copy_(decision.value);
  }

  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool hides_auxiliary) const override;

  /// Runs the policy for the agents at `indices`, i64 [n], of a batch.
  Decision decide(const PolicyInput& input, int64_t batch, const at::Tensor& indices, Renderer* renderer) const {
    at::set_num_threads(resolve_num_threads(config.run.num_threads));
    set_float32_products(config.train.precision);
    set_reproducible(config.train.reproducible);
    if (config.reads_images()) check_images(input, static_cast<size_t>(batch), renderer);
    const ChunkSizes chunks =
        input.full_chunk > 0 ? ChunkSizes{input.full_chunk, true} : ChunkSizes{config.train.forward_chunk};
    Decision decision = pictura::decide(indices, chunks, [&](const at::Tensor& some) {
      Observation observation = select_arrays(config, input.observations, device, batch, some);
      if (input.hides_auxiliary) hide_auxiliary(&observation);
      if (config.reads_images()) observation.images = draw(input, some, renderer);
      return policy.forward(observation);
    });
    check_outputs(decision.is_finite());
    return decision;
  }

  const std::unique_ptr<PolicyExecutor> executor;
  const std::unique_ptr<const Policy> own_policy;  // null if another object owns the policy
  const Policy& policy;

 private:
  std::vector<ImageBlock> draw(const PolicyInput& input, const at::Tensor& indices, Renderer* renderer) const {
    if (input.is_drawn.empty()) {
      return draw_images(*input.scene, SelectedViews(input.views, device, indices).views(), renderer,
                         policy.drawn_patch_px());
    }
    const auto batch = static_cast<int64_t>(input.is_drawn.size());
    const at::Tensor drawn =
        at::nonzero(tensor_over(input.is_drawn, device, {batch}).index_select(0, indices)).squeeze(1);
    const std::vector<ImageBlock> some =
        draw_images(*input.scene, SelectedViews(input.views, device, indices.index_select(0, drawn)).views(), renderer);
    std::vector<ImageBlock> all = allocate_images(rig, {indices.size(0)}, device);
    for (size_t i = 0; i < all.size(); ++i) all[i].pixels.zero_().index_copy_(0, drawn, some[i].pixels);
    return all;
  }
};

/// Controller of one simulator.
class TorchController final : public PolicyController {
 public:
  TorchController(const TorchSession* parts, Renderer* renderer, const ActionChoice& choice, bool hides_auxiliary)
      : parts_(*parts),
        renderer_(renderer),
        choice_(choice),
        hides_auxiliary_(hides_auxiliary),
        clock_(parts->config.policy.decision_steps) {}

  std::string_view name() const override { return "policy"; }

  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    check_controller_arrays(name(), input, parts_.device, mask, commands_out);
    const c10::OptionalStreamGuard guard(torch_stream(stream, parts_.device));
    const auto num_slots = static_cast<int64_t>(commands_out.size());
    if (!actions_.defined() || actions_.size(0) != num_slots) {
      actions_ = at::zeros({num_slots}, at::TensorOptions(at::kInt).device(torch_device(parts_.device)));
    }
    const at::Tensor active = active_slots(input, mask, false, parts_.executor.get());
    num_driven_ = active.size(0);
    const at::Tensor slots =
        clock_.select_deciding(input, active, step_++, /*decides_at_end=*/false, parts_.executor.get());
    const Decision decision = parts_.decide({.observations = input.observations,
                                             .scene = &input.scene,
                                             .views = input.views,
                                             .hides_auxiliary = hides_auxiliary_},
                                            num_slots, slots, renderer_);
    const Span<int32_t> actions = span_of<int32_t>(actions_);
    parts_.executor->choose_actions(input, span_of<const int64_t>(slots), span_of<const float>(decision.log_probs),
                                    choice_, actions, stream);
    parts_.executor->write_commands(actions, mask, commands_out, stream);
  }

  int64_t num_driven() const override { return num_driven_; }

 private:
  const TorchSession& parts_;
  Renderer* renderer_;
  ActionChoice choice_;
  bool hides_auxiliary_;
  DecisionClock clock_;
  int64_t step_ = 0;    // number of calls of act()
  at::Tensor actions_;  // i32 [slots] actions that agents hold until their next decision
  int64_t num_driven_ = 0;
};

std::unique_ptr<PolicyController> TorchSession::make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                                bool hides_auxiliary) const {
  return std::make_unique<TorchController>(this, renderer, ActionChoice{argmax, seed}, hides_auxiliary);
}

}  // namespace

std::unique_ptr<SessionParts> open_torch_session(const std::string& path, const SessionOptions& options) {
  const SavedPolicy saved = read_policy(path, options.average);
  const Config config = with_session_options(saved.config, options);
  const Device device = open_learning_device(config);
  auto session = std::make_unique<TorchSession>(config, device, chosen_rig(saved, options), options.camera_severity);
  restore_policy(saved, session->policy);
  return session;
}

PolicySession::PolicySession(const Config& config, const Rig& rig, Device device, const Policy& policy)
    : PolicySession(std::make_unique<TorchSession>(as_mounted(config), device, rig, 0, &policy)) {}

}  // namespace pictura
