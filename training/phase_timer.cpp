#include "pictura/training/phase_timer.h"

#include <c10/core/impl/VirtualGuardImpl.h>
#if defined(PICTURA_HAS_NVTX)
#include <nvtx3/nvToolsExt.h>
#endif

#include "pictura/policy/torch_device.h"

namespace pictura {

PhaseTimer::Scope::Scope(PhaseTimer* timer, Phase phase) : timer_(timer), phase_(phase) {
#if defined(PICTURA_HAS_NVTX)
  nvtxRangePushA(kPhaseNames[static_cast<size_t>(phase_)]);  // no effect without a profiler
#endif
  if (timer_ && !timer_->device_.is_host()) begin_ = timer_->record();
}

PhaseTimer::Scope::~Scope() {
#if defined(PICTURA_HAS_NVTX)
  nvtxRangePop();
#endif
  if (!timer_) return;
  if (timer_->device_.is_host())
    timer_->seconds_[static_cast<size_t>(phase_)] += watch_.seconds();
  else
    timer_->intervals_.push_back({phase_, begin_, timer_->record()});
}

size_t PhaseTimer::record() {
  const at::Device device = torch_device(device_);
  if (num_events_ == events_.size()) events_.emplace_back(device.type(), c10::EventFlag::BACKEND_DEFAULT);
  events_[num_events_].record(c10::impl::VirtualGuardImpl(device.type()).getStream(device));
  return num_events_++;
}

PhaseSeconds PhaseTimer::take() {
  if (num_events_ > 0) events_[num_events_ - 1].synchronize();
  for (const Interval& interval : intervals_) {
    const double elapsed_ms = events_[interval.begin].elapsedTime(events_[interval.end]);
    seconds_[static_cast<size_t>(interval.phase)] += elapsed_ms / 1000;
  }
  intervals_.clear();
  num_events_ = 0;
  return std::exchange(seconds_, {});
}

}  // namespace pictura
