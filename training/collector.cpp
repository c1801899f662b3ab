#include "pictura/training/collector.h"

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/training/schedule.h"

namespace pictura {

namespace {

// Returns the slots whose images are drawn and encoded: the active slots, or all slots if train.halted_slots makes
// halted agents as expensive as active agents.
at::Tensor seen_slots(const Run& run, const at::Tensor& active) {
  return run.config.train.halted_slots == HaltedSlots::skip ? active
                                                            : at::arange(run.rollout.num_slots(), active.options());
}

// Returns the policy's decision for active slots at a recorded step.
Decision decide(Run* run, int64_t step, const at::Tensor& active) {
  const TrainSection& config = run->config.train;
  const at::Tensor rows = run->rollout.rows_of(step, seen_slots(*run, active));
  // Matrix products may be rounded differently in chunks of another size. Full chunks all have one size, for any number
  // of ranks.
  const ChunkSizes chunks{config.forward_chunk, config.reproducible};
  Decision decision = decide(rows, chunks, [run](const at::Tensor& some) { return run->chunks.act(some); });
  if (rows.size(0) > active.size(0)) {
    for (at::Tensor* t : {&decision.logits, &decision.log_probs, &decision.value}) *t = t->index_select(0, active);
  }
  return decision;
}

}  // namespace

Collector::Collector(Run* run)
    : run_(*run),
      clock_(run->config.policy.decision_steps),
      graphs_(run->device, run->graphs.are_used()),
      records_(static_cast<size_t>(run->rollout.num_steps()) + 1),
      simulations_(static_cast<size_t>(run->rollout.num_steps())) {}

void Collector::forget_worlds() {
  for (auto* works : {&records_, &simulations_}) *works = std::vector<RepeatedWork>(works->size());
  graphs_.release_memory();
}

bool Collector::collect() {
  bool is_complete = false;
  run_.on_stream([&] { is_complete = collect_on_stream(); });
  return is_complete;
}

bool Collector::collect_on_stream() {
  Rollout& rollout = run_.rollout;
  Simulator& simulator = *run_.simulator;
  const Stream stream = current_stream(run_.device);
  rollout.values.zero_();
  // This flag stays on the device, so that no step waits for the device.
  at::Tensor are_finite = at::ones({}, rollout.values.options().dtype(at::kBool));
  for (int64_t step = 0; step < rollout.num_steps(); ++step) {
    if (run_.communicator->size() == 1 && interrupted()) return false;
    run_.communicator->step();

    const at::Tensor slots = record(step);
    const Decision decision = decide(&run_, step, slots);
    are_finite.logical_and_(decision.are_finite());
    record_teacher(step, slots);
    repeat_held_actions(step, slots);
    run_.executor->choose_actions(simulator.arrays(), span_of<const int64_t>(slots),
                                  span_of<const float>(decision.log_probs),
                                  {.argmax = false, .seed = simulator.config().seed}, rollout.actions_at(step), stream);
    const at::Tensor chosen = rollout.actions.select(0, step).index_select(0, slots).to(at::kLong).unsqueeze(1);
    rollout.values.select(0, step).index_copy_(0, slots, decision.value);
    rollout.log_probs.select(0, step).index_copy_(0, slots, decision.log_probs.gather(1, chosen).squeeze(1));

    simulate(step);
  }
  // Value of the last observation, from which the last transitions bootstrap.
  const at::Tensor slots = record(rollout.num_steps());
  const Decision last = decide(&run_, rollout.num_steps(), slots);
  rollout.values.select(0, rollout.num_steps()).index_copy_(0, slots, last.value);
  are_finite.logical_and_(last.are_finite());
  simulator.check(stream);
  PICTURA_CHECK(are_finite.item<bool>(),
                "update {}: expected finite logits and values in the rollout, got infinities or NaN", run_.update + 1);
  return true;
}

at::Tensor Collector::record(int64_t step) {
  RolloutObservations& observations = run_.rollout.observations;
  const SimulatorArrays input = run_.simulator->arrays();
  const at::Tensor own = run_.opponents ? run_.opponents->own_slots(input) : at::Tensor();
  const Span<const uint8_t> mask = own.defined() ? span_of<const uint8_t>(own) : Span<const uint8_t>();
  const at::Tensor slots = clock_.select_deciding(input, active_slots(input, mask, true, run_.executor.get()), step,
                                                  /*decides_at_end=*/true, run_.executor.get());
  // Slots with kept images differ between rollouts, so no graph can record them.
  if (observations.keep_images())
    observations.record(step, seen_slots(run_, slots));
  else
    records_[step].run(&graphs_, [&] { observations.record(step, slots); });
  return slots;
}

void Collector::repeat_held_actions(int64_t step, const at::Tensor& deciding) {
  Rollout& rollout = run_.rollout;
  if (!rollout.decides.defined()) return;
  rollout.decides.select(0, step).zero_().index_fill_(0, deciding, 1);
  if (step > 0) rollout.actions.select(0, step).copy_(rollout.actions.select(0, step - 1));
}

void Collector::record_teacher(int64_t step, const at::Tensor& slots) {
  Rollout& rollout = run_.rollout;
  const bool with_actions = teacher_weight_at(run_.config.train, run_.agent_steps) > 0,
             with_scene = rollout.teacher_scene.defined();
  if (!with_actions && !with_scene) return;
  const PhaseTimer::Scope timed(&run_.timer, Phase::forward);
  const Decision decision = run_.teacher->decide(run_.simulator->arrays(), slots, with_scene);
  if (with_actions) rollout.teacher_log_probs.select(0, step).index_copy_(0, slots, decision.log_probs);
  if (with_scene) rollout.teacher_scene.select(0, step).index_copy_(0, slots, decision.scene);
}

void Collector::simulate(int64_t step) {
  Rollout& rollout = run_.rollout;
  Span<const Command> commands;
  if (run_.opponents) {
    const PhaseTimer::Scope timed(&run_.timer, Phase::forward);
    commands = run_.opponents->commands(run_.simulator->arrays(), rollout.actions_at(step), run_.executor.get());
  }
  const PhaseTimer::Scope timed(&run_.timer, Phase::simulate);
  simulations_[step].run(&graphs_, [&] {
    const Stream stream = current_stream(run_.device);
    const Array actions(rollout.actions_at(step).data(), {rollout.num_slots()}, run_.device);
    rollout.set_result(
        step, commands.empty() ? run_.simulator->step(actions, stream) : run_.simulator->step(commands, stream),
        run_.device);
  });
}

}  // namespace pictura
