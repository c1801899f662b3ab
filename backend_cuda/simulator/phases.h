// The CUDA executor's step as phases over agents and worlds. A phase reads only data that an earlier phase has
// finished. A phase defines the work of every thread but not how threads are started, so that a host can also run the
// threads, in any order. There are three kinds of phases:
//   threads  one thread per item: phase(atomics, item)
//   groups   threads in lockstep (simulator/rules/thread_group.h), a group of them per item: phase(group, item)
//   teams    threads that wait for each other, one team per world: phase(team, world)
// backend_cuda/simulator/kernels.cu starts the phases on a device; tests/backend_cuda/simulator/shuffled_executor.h
// starts them on a host.
#pragma once

#include "pictura/backend_cuda/simulator/request_phases.h"
#include "pictura/backend_cuda/simulator/step_phases.h"
