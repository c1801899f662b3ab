#include "pictura/training/opponents.h"

#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/policy/observation.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/ranks/agree.h"

namespace pictura {

/// Policy with its observations, images and controller in the run's simulator.
struct Opponents::Opponent {
  Config config;
  std::unique_ptr<const Policy> policy;
  std::unique_ptr<PolicySession> session;
  std::unique_ptr<Renderer> renderer;
  std::unique_ptr<PolicyController> controller;
};

namespace {

// Returns an opponent's configuration. Observations and decision steps are those of its training. The sections `run`
// and `train` are those of the run, because threads, precision and determinism are settings of the process.
Config config_of(const SavedPolicy& saved, const Config& run) {
  Config config = with_session_options(saved.config, {});
  config.run = run.run;
  config.train = run.train;
  const std::string key = fmt::format("{}: simulator.others.policies", saved.path);
  PICTURA_CHECK(run.reads_images() || run.policy.auxiliary || config.reads_images() || !config.policy.auxiliary,
                "{}: its policy.auxiliary is true, expected false, as in the learner", key);
  PICTURA_CHECK(run.train.num_steps % config.policy.decision_steps == 0,
                "{}: its policy.decision_steps is {}, expected a divisor of train.num_steps ({})", key,
                config.policy.decision_steps, run.train.num_steps);
  return config;
}

at::Tensor driver_of_slots(const SimulatorArrays& input) {
  return tensor_over(input.driver, input.device, {static_cast<int64_t>(input.driver.size())});
}

}  // namespace

Opponents::Opponents(const Config& config, Device device, Communicator* communicator) {
  for (const std::string& text : config.simulator.other_policies) {
    const std::string path = parse_share(text)->name;
    const SavedPolicy saved = parse_policy(file_of_first(path, communicator), path);
    auto opponent = std::make_unique<Opponent>();
    opponent->config = config_of(saved, config);
    opponent->policy = make_policy(opponent->config, saved.rig, device);
    restore_policy(saved, *opponent->policy);
    opponent->session = std::make_unique<PolicySession>(opponent->config, saved.rig, device, *opponent->policy);
    opponents_.push_back(std::move(opponent));
  }
}

Opponents::~Opponents() = default;

void Opponents::add_arrays(SimulatorConfig* config) const {
  for (const auto& opponent : opponents_) config->add_observations(opponent->session->training_world());
}

void Opponents::enter(const Simulator& simulator) {
  commands_ = std::make_unique<DeviceCopy<Command>>(std::vector<Command>(static_cast<size_t>(simulator.num_slots())),
                                                    simulator.device());
  for (const auto& opponent : opponents_) {
    opponent->renderer = opponent->session->make_renderer();
    if (opponent->renderer) upload_maps(simulator, opponent->renderer.get());
    const bool hides_auxiliary =
        simulator.config().auxiliary_observations && !opponent->session->training_world().auxiliary_observations;
    opponent->controller = opponent->session->make_controller(opponent->renderer.get(), /*argmax=*/false,
                                                              simulator.config().seed, hides_auxiliary);
  }
}

at::Tensor Opponents::own_slots(const SimulatorArrays& input) const {
  return driver_of_slots(input).eq(0).to(at::kByte);
}

Span<const Command> Opponents::commands(const SimulatorArrays& input, Span<const int32_t> own_actions,
                                        PolicyExecutor* executor) {
  const Stream stream = current_stream(input.device);
  executor->write_commands(own_actions, {}, commands_->span(), stream);
  const at::Tensor drivers = driver_of_slots(input);
  for (size_t i = 0; i < opponents_.size(); ++i) {
    const at::Tensor mask = drivers.eq(static_cast<int64_t>(i) + 1).to(at::kByte);
    opponents_[i]->controller->act(input, span_of<const uint8_t>(mask), commands_->span(), stream);
  }
  return std::as_const(*commands_).span();
}

}  // namespace pictura
