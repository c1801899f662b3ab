// The CUDA executor's step as phases over agents and worlds. A phase reads only data that an earlier phase has
// finished. There are three kinds of phases:
//   threads  one thread per item: phase(atomics, item)
//   groups   threads in lockstep (simulator/rules/thread_group.h), a group per item: phase(group, item)
//   teams    threads that wait for each other, a team per world: phase(team, world)
// kernels.cu starts the phases on a device, and tests/backend_cuda/simulator/shuffled_executor.h on a host.
#pragma once

#include "pictura/backend_cuda/simulator/request_phases.h"
#include "pictura/backend_cuda/simulator/step_phases.h"
