// Time of an update by phase, measured by a host clock or by CUDA events, without waiting for the GPU.
#pragma once

#include <memory>
#include <vector>

#include <c10/core/Event.h>

#include "pictura/common/device.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/training/phases.h"

namespace pictura {

/// Timer of one device.
class PhaseTimer {
 public:
  explicit PhaseTimer(Device device) : device_(device) {}

  /// Scope whose lifetime counts as time of a phase; a null timer measures nothing. Scopes must not nest. Each scope is
  /// an NVTX range in NVIDIA's profilers.
  class Scope {
   public:
    Scope(PhaseTimer* timer, Phase phase);
    ~Scope();
    Scope(const Scope&) = delete;
    Scope& operator=(const Scope&) = delete;

   private:
    PhaseTimer* timer_;
    Phase phase_;
    size_t begin_ = 0;  // first event, on a GPU
    Stopwatch watch_;
  };

  /// Returns each phase's seconds since the last call. Waits for the device.
  PhaseSeconds take();

 private:
  struct Interval {
    Phase phase;
    size_t begin, end;
  };
  size_t record();

  Device device_;
  PhaseSeconds seconds_{};
  std::vector<c10::Event> events_;  // reused
  size_t num_events_ = 0;
  std::vector<Interval> intervals_;
};

}  // namespace pictura
