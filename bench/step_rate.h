// Step rate of a simulator with any backend. Random actions are written to the simulator's memory beforehand, so that
// only steps are timed.
#pragma once

#include <memory>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// One timed run of steps. Its time includes the wait for its end.
struct StepTiming {
  int64_t steps = 0;
  double elapsed_s = 0;
  int64_t agent_steps = 0;  // steps of active agents
  int64_t slot_steps = 0;
};

/// Steps one simulator with uniform random actions. A number of sets of actions is drawn and uploaded beforehand, and
/// steps use the sets cyclically.
class StepBench {
 public:
  StepBench(Simulator* simulator, uint64_t seed);
  ~StepBench();
  StepBench(const StepBench&) = delete;
  StepBench& operator=(const StepBench&) = delete;

  /// Takes `steps` steps and waits for their end.
  StepTiming run(int64_t steps);
  /// Takes steps for at least duration_s seconds. After every steps_between_clock_reads steps, waits for their end and
  /// reads the clock.
  StepTiming run_for(double duration_s, int64_t steps_between_clock_reads);

 private:
  struct Actions;
  Simulator* simulator_;
  std::unique_ptr<Actions> actions_;
  size_t next_ = 0;
};

}  // namespace pictura
