// Step rate of a simulator with any backend.
#pragma once

#include <memory>
#include <vector>

#include "pictura/simulator/simulator.h"

namespace pictura {

/// A timed run of steps, including the wait for its end.
struct StepTiming {
  int64_t steps = 0;
  double elapsed_s = 0;
  int64_t agent_steps = 0;  // steps of active agents
  int64_t slot_steps = 0;
};

/// Steps a simulator with uniform random actions, which are uploaded beforehand and used cyclically.
class StepBench {
 public:
  StepBench(Simulator* simulator, uint64_t seed);
  ~StepBench();
  StepBench(const StepBench&) = delete;
  StepBench& operator=(const StepBench&) = delete;

  StepTiming run(int64_t steps);
  /// Takes steps for at least duration_s seconds. Waits and reads the clock after every steps_between_clock_reads
  /// steps.
  StepTiming run_for(double duration_s, int64_t steps_between_clock_reads);

 private:
  struct Actions;
  Simulator* simulator_;
  std::unique_ptr<Actions> actions_;
  size_t next_ = 0;
};

}  // namespace pictura
