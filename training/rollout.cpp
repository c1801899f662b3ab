#include "pictura/training/rollout.h"

#include "pictura/backends/make_learner.h"
#include "pictura/common/error.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/memory.h"

namespace pictura {

namespace {

SceneHistorySize history_size(Simulator& simulator, int num_steps) {
  const SceneBatch& scene = simulator.scene();
  return {num_steps, scene.geometry.size(), scene.agents.size(), scene.light_states.size(), simulator.views().size()};
}

}  // namespace

RolloutObservations::RolloutObservations(const Config& config, Simulator* simulator, Renderer* renderer,
                                         PhaseTimer* timer)
    : simulator_(simulator), renderer_(renderer), timer_(timer) {
  const Device device = simulator->device();
  PICTURA_CHECK(!config.reads_images() || renderer, "training: a policy that reads images needs a renderer");
  PICTURA_CHECK(!renderer || renderer->device() == device,
                "training: simulator '{}' runs on {}, renderer '{}' on {}: expected both on one device",
                simulator->name(), name_of(device), renderer->name(), name_of(renderer->device()));
  const int num_slots = simulator->num_slots(), num_steps = config.train.num_steps + 1;
  arrays_ = allocate_observations(config, num_steps, num_slots, device);
  decision_steps_ = config.policy.decision_steps;
  if (!config.reads_images()) return;
  if (keeps_images(config, num_slots, device, available_bytes(device)))
    keep_images_of(renderer->config().rig);
  else
    scenes_ = make_scene_history(device, history_size(*simulator, num_steps));
}

void RolloutObservations::set_renderer(Renderer* renderer) {
  renderer_ = renderer;
  if (kept_images_) keep_images_of(renderer->config().rig);
}

void RolloutObservations::keep_images_of(const Rig& rig) {
  kept_images_.reset();  // free the memory before new images are allocated
  const int64_t num_rows = arrays_.ego.size(0), num_slots = arrays_.ego.size(1);
  kept_images_ = std::make_unique<KeptImages>(
      rig, num_rows, num_slots, num_slots * num_kept_images(num_rows - 1, decision_steps_), simulator_->device());
}

void RolloutObservations::record(int64_t step, const at::Tensor& slots) {
  const SimulatorArrays input = simulator_->arrays();
  const Observation row = row_of(arrays_, step);
  copy_arrays(input.observations, input.device, row);
  if (scenes_) {
    scenes_->put(static_cast<int>(step), input.scene, input.views, current_stream(input.device));
  } else if (kept_images_) {
    const PhaseTimer::Scope timed(timer_, Phase::render);
    const SelectedViews selected(input.views, input.device, slots);
    kept_images_->put(step, slots, draw_images(input.scene, selected.views(), renderer_));
  }
  are_complete_ = are_complete_ || step + 1 == arrays_.ego.size(0);
}

Observation RolloutObservations::gather(const at::Tensor& rows, int patch_px) const {
  Observation result = arrays_.map([&rows](const at::Tensor& t) { return t.flatten(0, 1).index_select(0, rows); });
  if (scenes_) {
    SelectedViews selected(rows.size(0), scenes_->device());
    scenes_->gather(span_of<const int64_t>(rows), selected.views(), current_stream(scenes_->device()));
    result.images = draw_images(scenes_->scene(), selected.views(), renderer_, patch_px);
  } else if (kept_images_) {
    result.images = kept_images_->gather(rows);
  }
  return result;
}

Rollout::Rollout(RolloutObservations its_observations, int64_t num_steps, int64_t num_slots, Device device)
    : observations(std::move(its_observations)) {
  const auto zeros = [&](at::ScalarType type, int64_t steps) {
    return at::zeros({steps, num_slots}, at::TensorOptions(type).device(torch_device(device)));
  };
  values = zeros(at::kFloat, num_steps + 1);
  actions = zeros(at::kInt, num_steps);
  for (at::Tensor* t : {&log_probs, &rewards, &advantages}) *t = zeros(at::kFloat, num_steps);
  for (at::Tensor* t : {&terminated, &truncated, &valid}) *t = zeros(at::kByte, num_steps);
}

Span<int32_t> Rollout::actions_at(int64_t step) { return span_of<int32_t>(actions.select(0, step)); }

void Rollout::set_result(int64_t step, const StepResult& result, Device device) {
  const auto copy = [&](auto array, const at::Tensor& to) {
    to.select(0, step).copy_(tensor_over(array, device, {num_slots()}));
  };
  copy(result.reward, rewards);
  copy(result.terminated, terminated);
  copy(result.truncated, truncated);
  copy(result.valid, valid);
}

void Rollout::compute_advantages(double gamma, double gae_lambda, LearnerExecutor* executor) {
  executor->compute_advantages(
      {span_of<const float>(rewards), span_of<const float>(values), span_of<const uint8_t>(terminated),
       span_of<const uint8_t>(truncated), span_of<const uint8_t>(valid),
       decides.defined() ? span_of<const uint8_t>(decides) : Span<const uint8_t>(), num_steps(), num_slots()},
      static_cast<float>(gamma), static_cast<float>(gae_lambda), span_of<float>(advantages),
      current_stream(executor->device()));
}

}  // namespace pictura
