#include "pictura/policy/session.h"

#include <ATen/Parallel.h>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/backends/make_renderer.h"
#include "pictura/common/error.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/policy/decision_clock.h"
#include "pictura/policy/observation.h"
#include "pictura/policy/precision.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/policy/torch_device.h"
#include "pictura/simulator/controllers/host_controllers.h"

namespace pictura {

Config adapted(const Config& trained, const SessionOptions& options) {
  Config config = with_evaluate_conditioning(trained, options.conditioning);
  config.run.num_threads = options.num_threads;
  config.run.device = options.device;
  config.simulator.backend = options.simulator;
  config.simulator.walls |= options.adds_walls;
  config.simulator.light_cycles = options.light_cycles.value_or(config.simulator.light_cycles);
  config.simulator.light_heads = options.light_heads.value_or(config.simulator.light_heads);
  if (!options.backbone.empty()) config.policy.backbone = options.backbone;
  if (options.decision_steps < 0 || options.decision_steps > kMaxDecisionSteps) {
    fail_usage("decision_steps: expected 0 to {}, got {}", kMaxDecisionSteps, options.decision_steps);
  }
  if (options.decision_steps > 0) config.policy.decision_steps = options.decision_steps;
  if (!(options.camera_severity >= 0 && options.camera_severity <= kMaxCameraSeverity)) {
    fail_usage("camera_severity: expected 0 to {}, got {}", kMaxCameraSeverity, options.camera_severity);
  }
  if (options.camera_severity > 0 && !trained.reads_images()) {
    fail_usage("camera_severity: expected a policy that reads images");
  }
  config.render.randomization = scaled(kFullCameraSeverity, options.camera_severity);
  std::string& renderer = config.render.backend;
  if (!options.renderer.empty())
    renderer = options.renderer;
  else if (renderer == "cpu" || renderer == "cuda")
    renderer = "auto";
  if (!options.samples.empty()) {
    const std::optional<PixelSamples> samples = parse_pixel_samples(options.samples);
    if (!samples) fail_usage("samples: expected {}, got '{}'", kPixelSamplesExpected, options.samples);
    config.render.samples = *samples;
  } else if (!renderer.starts_with("gl")) {
    config.render.samples = {};  // exact coverage
  }
  return config;
}

namespace {

Config with_seed(Config config, uint64_t seed) {
  config.run.seed = seed;
  return config;
}

// Returns the configuration with cameras mounted as in the rig, even if they were randomized in training.
Config as_mounted(Config config) {
  config.render.randomization = {};
  return config;
}

// Returns the rig of the options, else the rig of training. No weight depends on sizes or poses.
Rig chosen_rig(const SavedPolicy& saved, const SessionOptions& options) {
  std::optional<Rig> named = named_rig(options);
  if (!named) return saved.rig;
  if (!saved.config.reads_images()) fail_usage("{}: its policy reads no images: no rig or size", saved.path);
  if (options.rig.empty() && !saved.config.render.rig.empty()) {
    fail_usage("{}: trained with the cameras of {}: expected a rig file with other sizes instead of a size", saved.path,
               saved.config.render.rig);
  }
  const size_t expected = saved.rig.cameras.size();
  if (named->cameras.size() != expected) {
    fail_usage("{}: expected {} cameras, as the policy was trained with, got {}", options.rig, expected,
               named->cameras.size());
  }
  return *named;
}

}  // namespace

std::optional<Rig> named_rig(const SessionOptions& options) {
  const bool has_size = options.width_px != 0 || options.height_px != 0;
  if (has_size && !options.rig.empty()) fail_usage("rig: has sizes of its own: expected a rig or a size, got both");
  if (has_size) return paper_rig(options.width_px, options.height_px);
  if (options.rig.empty()) return std::nullopt;
  return load_rig(options.rig);
}

RendererConfig evaluation_renderer_config(const Config& config, const Rig& rig, Device device) {
  RendererConfig result = renderer_config(config, rig, device);
  result.randomization.seed = 0;
  return result;
}

struct PolicySession::Parts {
  Parts(const SavedPolicy& saved, const SessionOptions& options)
      : config(adapted(saved.config, options)),
        device(open_learning_device(config)),
        rig(chosen_rig(saved, options)),
        camera_severity(options.camera_severity),
        executor(make_policy_executor(device)),
        own_policy(make_policy(config, rig, device)),
        policy(*own_policy) {
    restore_policy(saved, policy);
  }
  Parts(const Parts& trained, uint64_t seed)
      : config(with_seed(trained.config, seed)),
        device(trained.device),
        rig(trained.rig),
        camera_severity(trained.camera_severity),
        executor(make_policy_executor(device)),
        own_policy(make_policy(config, rig, device)),
        policy(*own_policy) {}
  Parts(const Config& its_config, const Rig& its_rig, Device its_device, const Policy& its_policy)
      : config(as_mounted(its_config)),
        device(its_device),
        rig(its_rig),
        executor(make_policy_executor(device)),
        policy(its_policy) {}

  /// Runs the policy for the agents of a batch at `indices`, i64 [n].
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
    PICTURA_CHECK(decision.is_finite(),
                  "policy: expected finite logits and values, got infinities or NaN: its weights are "
                  "too large for {}",
                  device.is_host() ? "fp32" : name_of(config.train.precision));
    return decision;
  }

  const Config config;
  const Device device;
  const Rig rig;
  const double camera_severity = 0;
  const std::unique_ptr<PolicyExecutor> executor;
  const std::unique_ptr<const Policy> own_policy;  // null if another object owns the policy
  const Policy& policy;

 private:
  void check_images(const PolicyInput& input, size_t batch, const Renderer* renderer) const {
    PICTURA_CHECK(renderer && input.scene, "policy: it reads images: expected a renderer and a scene");
    PICTURA_CHECK(renderer->device() == device, "policy: expected a renderer for memory of {}, got one for {}",
                  name_of(device), name_of(renderer->device()));
    PICTURA_CHECK(input.views.size() == batch, "policy: expected {} views, got {}", batch, input.views.size());
    PICTURA_CHECK(input.is_drawn.empty() || input.is_drawn.size() == batch,
                  "policy: is_drawn: expected {} flags, got {}", batch, input.is_drawn.size());
  }

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
class SessionController final : public PolicyController {
 public:
  SessionController(const PolicySession::Parts* parts, Renderer* renderer, const ActionChoice& choice,
                    bool hides_auxiliary)
      : parts_(*parts),
        renderer_(renderer),
        choice_(choice),
        hides_auxiliary_(hides_auxiliary),
        clock_(parts->config.policy.decision_steps) {}

  std::string_view name() const override { return "policy"; }

  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name(), input, parts_.device, mask, commands_out);
    const auto num_slots = static_cast<int64_t>(commands_out.size());
    if (!actions_.defined() || actions_.size(0) != num_slots) {
      actions_ = at::zeros({num_slots}, at::TensorOptions(at::kInt).device(torch_device(parts_.device)));
    }
    const at::Tensor active = active_slots(input, mask, false, parts_.executor.get());
    num_driven_ = active.size(0);
    const at::Tensor slots = clock_.deciding(input, active, step_++);
    const Decision decision = parts_.decide({.observations = input.observations,
                                             .scene = &input.scene,
                                             .views = input.views,
                                             .hides_auxiliary = hides_auxiliary_},
                                            num_slots, slots, renderer_);
    const Span<int32_t> actions = span_of<int32_t>(actions_);
    parts_.executor->choose_actions(input, span_of<const int64_t>(slots), span_of<const float>(decision.log_probs),
                                    choice_, actions, current_stream(parts_.device));
    parts_.executor->write_commands(actions, mask, commands_out, current_stream(parts_.device));
  }

  int64_t num_driven() const override { return num_driven_; }

 private:
  const PolicySession::Parts& parts_;
  Renderer* renderer_;
  ActionChoice choice_;
  bool hides_auxiliary_;
  DecisionClock clock_;
  int64_t step_ = 0;    // calls of act()
  at::Tensor actions_;  // i32 [slots], held until the next decision
  int64_t num_driven_ = 0;
};

PolicySession::PolicySession(const std::string& path, const SessionOptions& options)
    : parts_(std::make_unique<Parts>(read_policy(path, options.average), options)) {}

PolicySession::PolicySession(const Config& config, const Rig& rig, Device device, const Policy& policy)
    : parts_(std::make_unique<Parts>(config, rig, device, policy)) {}

PolicySession::PolicySession(std::unique_ptr<Parts> parts) : parts_(std::move(parts)) {}

PolicySession::~PolicySession() = default;

std::unique_ptr<PolicySession> PolicySession::untrained(uint64_t seed) const {
  return std::unique_ptr<PolicySession>(new PolicySession(std::make_unique<Parts>(*parts_, seed)));
}

bool PolicySession::reads_images() const { return parts_->config.reads_images(); }

const Rig& PolicySession::rig() const { return parts_->rig; }

double PolicySession::camera_severity() const { return parts_->camera_severity; }

Device PolicySession::device() const { return parts_->device; }

RendererConfig PolicySession::renderer_config() const {
  return evaluation_renderer_config(parts_->config, parts_->rig, parts_->device);
}

std::unique_ptr<Renderer> PolicySession::make_renderer() const {
  return reads_images() ? pictura::make_renderer(parts_->config.render.backend, renderer_config()) : nullptr;
}

SimulatorConfig PolicySession::training_world() const { return simulator_config(parts_->config, parts_->device); }

SimulatorConfig PolicySession::evaluation_world(int steps) const {
  return evaluation_simulator_config(parts_->config, steps, parts_->device);
}

const Config& PolicySession::config() const { return parts_->config; }

std::string PolicySession::policy_hash() const { return parts_->policy.hash(); }

void PolicySession::evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out,
                             Span<float> values_out) {
  PICTURA_CHECK(logits_out.size() == values_out.size() * kNumActions,
                "policy: expected memory for {} logits, {} for each value, got {}", values_out.size() * kNumActions,
                kNumActions, logits_out.size());
  if (values_out.empty()) return;
  const auto batch = static_cast<int64_t>(values_out.size());
  const at::Tensor all = at::arange(batch, at::TensorOptions(at::kLong).device(torch_device(parts_->device)));
  const Decision decision = parts_->decide(input, batch, all, renderer);
  tensor_over(logits_out, parts_->device, {batch, kNumActions}).copy_(decision.logits);
  tensor_over(values_out, parts_->device, {batch}).copy_(decision.value);
}

std::unique_ptr<PolicyController> PolicySession::make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                                 bool hides_auxiliary) {
  PICTURA_CHECK(!reads_images() || renderer, "policy: it reads images: expected a renderer");
  return std::make_unique<SessionController>(parts_.get(), renderer, ActionChoice{argmax, seed}, hides_auxiliary);
}

}  // namespace pictura
