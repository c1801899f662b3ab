// Observer of waits at red lights, creeping, reversing, and stuck vehicles.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/evaluation/results.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Computes the StandingCounts of worlds. With a GPU, each step copies the needed data to the host.
class StandingObserver final : public StepObserver {
 public:
  /// The simulator must be at the start of its episodes.
  explicit StandingObserver(Simulator& simulator);
  /// Counts each driver's vehicles separately. driver_of_slot: [slots], below num_drivers.
  StandingObserver(Simulator& simulator, std::vector<uint8_t> driver_of_slot, size_t num_drivers);

  void after_step(const StepResult& result) override;
  /// Returns [worlds]: counts of one driver's vehicles. Call after the last step.
  std::vector<StandingCounts> counts(size_t driver = 0) const;

 private:
  struct Progress {
    int step = 0;
    float distance_m = 0;
  };

  Simulator& simulator_;
  int step_ = 0;
  std::vector<int32_t> awaited_light_;               // [slots] index of the light in its world; -1: none
  std::vector<Progress> progress_;                   // [slots]
  std::vector<uint8_t> driver_of_slot_;              // [slots]
  std::vector<std::vector<StandingCounts>> counts_;  // [drivers][worlds]
};

}  // namespace pictura
