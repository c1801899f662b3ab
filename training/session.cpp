#include "pictura/training/session.h"

#include <ATen/Parallel.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/common/error.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/training/checkpoint.h"
#include "pictura/training/observation.h"

namespace pictura {

namespace {

// The settings of training with what the options change. Those of devices are of the machine that trained it: here
// whatever draws the same images will do.
Config adapted(Config config, const SessionOptions& options) {
  config.run.num_threads = options.num_threads;
  config.run.device = options.device;
  config.simulator.backend = "auto";
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
  check_devices(config);
  return config;
}

}  // namespace

struct PolicySession::Parts {
  Parts(const Checkpoint& checkpoint, const SessionOptions& options)
      : config(adapted(checkpoint.config, options)), rig(checkpoint.rig), policy(make_policy(config, rig)) {
    restore_tensors(checkpoint, checkpoint.parameters, policy.parameters());
  }

  Decision decide(const PolicyInput& input, int64_t batch, Renderer* renderer) {
    at::set_num_threads(resolve_num_threads(config.run.num_threads));
    if (!storage.ego.defined() || storage.ego.size(1) != batch) storage = allocate_observations(config, rig, 1, batch);
    const Observation observation = row_of(storage, 0);
    copy_arrays(input.observations, observation);
    if (config.reads_images()) draw(input, batch, renderer, observation);
    return pictura::decide(policy, observation, config.train.forward_chunk);
  }

  const Config config;
  const Rig rig;
  const Policy policy;
  Observation storage;  // [1, batch, ...]

 private:
  static void draw(const PolicyInput& input, int64_t batch, Renderer* renderer, const Observation& out) {
    PICTURA_CHECK(renderer && input.scene, "policy: it reads images: expected a renderer and a scene");
    PICTURA_CHECK(renderer->device().is_host(), "policy: expected a renderer for host memory, got one for {}",
                  name_of(renderer->device()));
    const auto size = static_cast<size_t>(batch);
    PICTURA_CHECK(input.views.size() == size, "policy: expected {} views, got {}", size, input.views.size());
    PICTURA_CHECK(input.is_drawn.empty() || input.is_drawn.size() == size,
                  "policy: is_drawn: expected {} flags, got {}", size, input.is_drawn.size());
    std::vector<int64_t> drawn;
    for (size_t i = 0; i < size; ++i) {
      if (input.is_drawn.empty() || input.is_drawn[i]) drawn.push_back(static_cast<int64_t>(i));
    }
    draw_images(*input.scene, input.views, drawn, renderer, out);
  }
};

/// A policy for one simulator.
class PolicyController final : public Controller {
 public:
  PolicyController(PolicySession::Parts* parts, Renderer* renderer, bool argmax, uint64_t seed)
      : parts_(*parts), renderer_(renderer), argmax_(argmax), seed_(seed) {}

  std::string_view name() const override { return "policy"; }

  void act(const ControllerInput& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name(), input, Device{}, mask, commands_out);
    const size_t num_slots = commands_out.size();
    is_drawn_.assign(num_slots, 0);
    for (const int64_t slot : active_slots(input, mask)) is_drawn_[static_cast<size_t>(slot)] = 1;
    const Decision decision = parts_.decide({input.observations, &input.scene, input.views, is_drawn_},
                                            static_cast<int64_t>(num_slots), renderer_);
    actions_.resize(num_slots);
    choose_actions(decision.log_probs, input, seed_, argmax_, actions_);
    for (size_t slot = 0; slot < num_slots; ++slot) {
      if (!mask.empty() && !mask[slot]) continue;
      commands_out[slot] = {};
      commands_out[slot].action = actions_[slot];
    }
  }

 private:
  PolicySession::Parts& parts_;
  Renderer* renderer_;
  bool argmax_;
  uint64_t seed_;
  std::vector<uint8_t> is_drawn_;
  std::vector<int32_t> actions_;
};

PolicySession::PolicySession(const std::string& checkpoint_path, const SessionOptions& options)
    : parts_(std::make_unique<Parts>(read_checkpoint(checkpoint_path), options)) {}

PolicySession::~PolicySession() = default;

bool PolicySession::reads_images() const { return parts_->config.reads_images(); }

const Rig& PolicySession::rig() const { return parts_->rig; }

RendererConfig PolicySession::renderer_config() const { return pictura::renderer_config(parts_->config, parts_->rig); }

std::unique_ptr<Renderer> PolicySession::make_renderer() const {
  return reads_images() ? pictura::make_renderer(parts_->config.render.backend, renderer_config()) : nullptr;
}

SimulatorConfig PolicySession::training_world() const { return simulator_config(parts_->config); }

SimulatorConfig PolicySession::evaluation_world(int steps) const {
  return evaluation_simulator_config(parts_->config, steps);
}

void PolicySession::evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out,
                             Span<float> values_out) {
  PICTURA_CHECK(logits_out.size() == values_out.size() * kNumActions,
                "policy: expected memory for {} logits, {} for each value, got {}", values_out.size() * kNumActions,
                kNumActions, logits_out.size());
  if (values_out.empty()) return;
  const Decision decision = parts_->decide(input, static_cast<int64_t>(values_out.size()), renderer);
  const at::Tensor logits = decision.logits.contiguous(), values = decision.value.contiguous();
  std::copy_n(logits.const_data_ptr<float>(), logits_out.size(), logits_out.begin());
  std::copy_n(values.const_data_ptr<float>(), values_out.size(), values_out.begin());
}

std::unique_ptr<Controller> PolicySession::make_controller(Renderer* renderer, bool argmax, uint64_t seed) {
  PICTURA_CHECK(!reads_images() || renderer, "policy: it reads images: expected a renderer");
  return std::make_unique<PolicyController>(parts_.get(), renderer, argmax, seed);
}

}  // namespace pictura
