#include "pictura/bench/step_rate.h"

#include <chrono>

#include "pictura/common/error.h"
#include "pictura/simulator/rules/control.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/common/cuda/device_buffer.h"
#endif

namespace pictura {

namespace {

constexpr size_t kActionSets = 64;

std::vector<int32_t> draw_actions(uint64_t seed, const std::vector<WorldSpec>& worlds, uint32_t step) {
  std::vector<int32_t> actions;
  for (const WorldSpec& world : worlds) {
    for (int agent = 0; agent < world.num_agents; ++agent) {
      actions.push_back(random_action(seed, world.global_world, agent, step));
    }
  }
  return actions;
}

}  // namespace

struct StepBench::Actions {
  std::vector<std::vector<int32_t>> host;
#ifdef PICTURA_HAS_CUDA
  std::vector<DeviceBuffer<int32_t>> device;
#endif
  std::vector<Array> sets;  // in the simulator's memory
};

StepBench::StepBench(Simulator* simulator, uint64_t seed)
    : simulator_(simulator), actions_(std::make_unique<Actions>()) {
  for (uint32_t step = 0; step < kActionSets; ++step) {
    actions_->host.push_back(draw_actions(seed, simulator->worlds(), step));
  }
  for (const std::vector<int32_t>& set : actions_->host) {
    if (simulator->device().is_host()) {
      actions_->sets.push_back(set);
      continue;
    }
#ifdef PICTURA_HAS_CUDA
    const DeviceBuffer<int32_t>& uploaded = actions_->device.emplace_back(Span<const int32_t>(set));
    actions_->sets.emplace_back(uploaded.data(), Dims{simulator->num_slots()}, simulator->device());
#else
    fail("step bench: simulator {}: this build does not support device memory", simulator->name());
#endif
  }
}

StepBench::~StepBench() = default;

StepTiming StepBench::run(int64_t steps) {
  using Clock = std::chrono::steady_clock;
  simulator_->check();
  const SimulatorTotals before = simulator_->totals();
  const auto begin = Clock::now();
  for (int64_t step = 0; step < steps; ++step) simulator_->step(actions_->sets[next_++ % kActionSets]);
  simulator_->check();
  const double elapsed_s = std::chrono::duration<double>(Clock::now() - begin).count();
  SimulatorTotals done = simulator_->totals();
  done.subtract(before);
  return {steps, elapsed_s, done.agent_steps, done.slot_steps};
}

StepTiming StepBench::run_for(double duration_s, int64_t steps_between_clock_reads) {
  StepTiming sum;
  while (sum.elapsed_s < duration_s) {
    const StepTiming part = run(steps_between_clock_reads);
    sum.steps += part.steps;
    sum.elapsed_s += part.elapsed_s;
    sum.agent_steps += part.agent_steps;
    sum.slot_steps += part.slot_steps;
  }
  return sum;
}

}  // namespace pictura
