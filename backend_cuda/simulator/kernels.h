// Kernels that the simulator's host side launches, asynchronously on a stream. Callers check cudaGetLastError().
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/backend_cuda/simulator/phases.h"
#include "pictura/simulator/rules/control.h"

namespace pictura::cuda {

/// The caller's stream, a second stream for work that may overlap, and events that order both.
struct StepStreams {
  cudaStream_t main = nullptr, side = nullptr;
  cudaEvent_t forked = nullptr, joined = nullptr;
  bool may_begin_early = false;  // see may_begin_early()
};

/// Whether kernels of thread groups may begin while the previous kernel ends. They may if their code for the current
/// device was compiled for compute capability 9.0 or later, because it then calls wait_for_earlier_launch().
bool may_begin_early();

/// mask: [worlds]; null: all worlds.
void launch_reset(const PhaseArrays& arrays, const uint8_t* mask, uint64_t seed, const StepStreams& streams);
void launch_edit(const PhaseArrays& arrays, const StateEdit& edit, const StepStreams& streams);
void launch_queries(const PhaseArrays& arrays, const ObservationQueries& asked, const StepStreams& streams);
void launch_publish_restored(const PhaseArrays& arrays, const StepStreams& streams);
void launch_step(const PhaseArrays& arrays, const int32_t* actions, const StepStreams& streams);
void launch_step(const PhaseArrays& arrays, const Command* commands, const StepStreams& streams);

/// Writes the commands of a rule of simulator/rules/control.h. mask: [slots]; null: all slots.
template <typename Rule>
void launch_commands(const Rule& rule, int32_t num_slots, const uint8_t* mask, Command* commands_out,
                     cudaStream_t stream);

}  // namespace pictura::cuda
