#include "pictura/training/session.h"

#include <ATen/Parallel.h>

#include "pictura/common/error.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/training/checkpoint.h"
#include "pictura/training/observation.h"

namespace pictura {

namespace {

class PolicyDriver final : public Driver {
 public:
  PolicyDriver(const Checkpoint& checkpoint, int num_threads)
      : config_(checkpoint.config),
        rig_(checkpoint.rig),
        policy_(make_policy(config_, rig_)),
        num_threads_(num_threads) {
    restore_tensors(checkpoint, checkpoint.parameters, policy_.parameters());
  }

  bool needs_images() const override { return config_.policy.modality == Modality::perspective; }
  const Rig& rig() const override { return rig_; }
  SimulatorConfig evaluation_world() const override {
    return evaluation_simulator_config(config_, config_.simulator.episode_steps);
  }

  void act(Simulator& simulator, Renderer* renderer, bool argmax, Span<int32_t> actions_out) override {
    PICTURA_CHECK(!needs_images() || renderer, "driver: this policy needs images: give it a renderer");
    PICTURA_CHECK(actions_out.size() == static_cast<size_t>(simulator.num_slots()),
                  "driver: expected room for {} actions, got {}", simulator.num_slots(), actions_out.size());
    at::set_num_threads(resolve_num_threads(num_threads_));
    Observer observer(config_, &simulator, renderer);
    if (!storage_.ego.defined() || storage_.ego.size(1) != simulator.num_slots()) storage_ = observer.allocate(1);
    const Observation row = row_of(storage_, 0);
    observer.observe(row);
    const Decision decision = decide(policy_, row, config_.train.forward_chunk);
    choose_actions(decision.log_probs, simulator.controller_input(), simulator.config().seed, argmax, actions_out);
  }

 private:
  const Config config_;
  const Rig rig_;
  const Policy policy_;
  const int num_threads_;
  Observation storage_;
};

}  // namespace

std::unique_ptr<Driver> load_driver(const std::string& checkpoint_path, int num_threads) {
  return std::make_unique<PolicyDriver>(read_checkpoint(checkpoint_path), num_threads);
}

}  // namespace pictura
