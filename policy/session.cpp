#include "pictura/policy/session.h"

#include "pictura/backends/make_renderer.h"
#include "pictura/common/error.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/policy/session_parts.h"
#include "pictura/simulator/actions.h"

namespace pictura {

Config with_session_options(const Config& trained, const SessionOptions& options) {
  Config config = with_evaluate_conditioning(trained, options.conditioning);
  config.run.num_threads = options.num_threads;
  if (!is_device(options.device)) fail_usage("device: expected one of {}; got '{}'", kDevices, options.device);
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
    config.render.samples = {};  // without samples: exact coverage
  }
  return config;
}

std::optional<Rig> named_rig(const SessionOptions& options) {
  const bool has_size = options.width_px != 0 || options.height_px != 0;
  if (has_size && !options.rig.empty()) fail_usage("rig: has its own sizes: expected a rig or a size, got both");
  if (has_size) return paper_rig(options.width_px, options.height_px);
  if (options.rig.empty()) return std::nullopt;
  return load_rig(options.rig);
}

RendererConfig evaluation_renderer_config(const Config& config, const Rig& rig, Device device) {
  RendererConfig result = renderer_config(config, rig, device);
  result.randomization.seed = 0;
  return result;
}

Rig chosen_rig(const PolicyFacts& saved, const SessionOptions& options) {
  std::optional<Rig> named = named_rig(options);
  if (!named) return saved.rig;
  if (!saved.config.reads_images()) fail_usage("{}: its policy reads no images: no rig or size", saved.path);
  if (options.rig.empty() && !saved.config.render.rig.empty()) {
    fail_usage("{}: trained with the cameras of {}: expected a rig file with other sizes instead of a size", saved.path,
               saved.config.render.rig);
  }
  const size_t expected = saved.rig.cameras.size();
  if (named->cameras.size() != expected) {
    fail_usage("{}: expected {} cameras, as in training, got {}", options.rig, expected, named->cameras.size());
  }
  return *named;
}

void SessionParts::check_images(const PolicyInput& input, size_t batch, const Renderer* renderer) const {
  PICTURA_CHECK(renderer && input.scene, "policy: it reads images: expected a renderer and a scene");
  PICTURA_CHECK(renderer->device() == device, "policy: expected a renderer for memory of {}, got one for {}",
                name_of(device), name_of(renderer->device()));
  PICTURA_CHECK(input.views.size() == batch, "policy: expected {} views, got {}", batch, input.views.size());
  PICTURA_CHECK(input.is_drawn.empty() || input.is_drawn.size() == batch, "policy: is_drawn: expected {} flags, got {}",
                batch, input.is_drawn.size());
}

void SessionParts::check_outputs(bool are_finite) const {
  PICTURA_CHECK(are_finite,
                "policy: expected finite logits and values, got infinities or NaN: its weights are "
                "too large for {}",
                device.is_host() ? "fp32" : name_of(config.train.precision));
}

PolicySession::PolicySession(const std::string& path, const SessionOptions& options)
#ifdef PICTURA_HAS_TORCH
    : PolicySession(open_torch_session(path, options)){}
#else
    : PolicySession(open_host_session(path, options)) {
}
#endif

      PolicySession::PolicySession(std::unique_ptr<SessionParts> parts)
    : parts_(std::move(parts)) {
}

PolicySession::~PolicySession() = default;

std::unique_ptr<PolicySession> PolicySession::make_untrained(uint64_t seed) const {
  return std::make_unique<PolicySession>(parts_->make_untrained(seed));
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

SimulatorConfig PolicySession::training_world() const {
  SimulatorConfig world = simulator_config(parts_->config, parts_->device);
  world.vector_observations |= parts_->observes_vectors;
  return world;
}

SimulatorConfig PolicySession::evaluation_world(int steps) const {
  SimulatorConfig world = evaluation_simulator_config(parts_->config, steps, parts_->device);
  world.vector_observations |= parts_->observes_vectors;
  return world;
}

const Config& PolicySession::config() const { return parts_->config; }

std::string PolicySession::policy_hash() const { return parts_->policy_hash(); }

void PolicySession::evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out,
                             Span<float> values_out) {
  PICTURA_CHECK(logits_out.size() == values_out.size() * kNumActions,
                "policy: expected memory for {} logits, {} for each value, got {}", values_out.size() * kNumActions,
                kNumActions, logits_out.size());
  if (!values_out.empty()) parts_->evaluate(input, renderer, logits_out, values_out);
}

std::unique_ptr<PolicyController> PolicySession::make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                                 bool hides_auxiliary) {
  PICTURA_CHECK(!reads_images() || renderer, "policy: it reads images: expected a renderer");
  return parts_->make_controller(renderer, argmax, seed, hides_auxiliary);
}

}  // namespace pictura
