// The CUDA executor's step as phases over agents and worlds, which read only what an earlier phase has finished.
// They say what every thread does and not how threads are started, so that a host can run them too, in any order:
//   threads  one thread per item: phase(atomics, item)
//   groups   threads in lockstep (simulator/rules/thread_group.h), a group of them per item: phase(group, item)
//   teams    threads that wait for each other, one team per world: phase(team, world)
// backend_cuda/simulator/kernels.cu starts them on a device; tests/backend_cuda/simulator/shuffled_executor.h on a
// host.
#pragma once

#include "pictura/backend_cuda/simulator/request_phases.h"
#include "pictura/backend_cuda/simulator/step_phases.h"
