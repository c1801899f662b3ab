// Measures the time of an update by phase: with a clock on the host, and with CUDA events on a GPU. Measuring does not
// wait for the GPU.
#pragma once

#include <memory>
#include <vector>

#include <c10/core/Event.h>

#include "pictura/common/device.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/training/phases.h"

namespace pictura {

/// Timer of the phases of one device.
class PhaseTimer {
 public:
  explicit PhaseTimer(Device device) : device_(device) {}

  /// Scope whose lifetime counts as time of a phase. With a null timer nothing is measured. Scopes must not nest. In
  /// NVIDIA's profilers each scope is an NVTX range with the phase's name.
  class Scope {
   public:
    Scope(PhaseTimer* timer, Phase phase);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    PhaseTimer* timer_;
    Phase phase_;
    size_t begin_ = 0;  // on a GPU: index of the scope's first event
    Stopwatch watch_;
  };

  /// Returns the seconds of each phase since the last call. Waits for the device.
  PhaseSeconds take();

 private:
  struct Interval {
    Phase phase;
    size_t begin, end;
  };
  /// Records an event and returns its index.
  size_t record();

  Device device_;
  PhaseSeconds seconds_{};
  std::vector<c10::Event> events_;  // reused
  size_t num_events_ = 0;
  std::vector<Interval> intervals_;
};

}  // namespace pictura
