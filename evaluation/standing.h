// Observer of standing and reversing vehicles. It measures waits at red lights, creeping during these waits, reversing,
// and vehicles that remain stuck.
#pragma once

#include <cstdint>
#include <vector>

#include "pictura/evaluation/results.h"
#include "pictura/simulator/step_observer.h"

namespace pictura {

/// Computes the StandingCounts of worlds that are driven to the end. If the simulator runs on a GPU, the data that the
/// observer reads are copied to the host at every step.
class StandingObserver final : public StepObserver {
 public:
  /// Creates an observer; the simulator's worlds must be at the start of their episodes.
  explicit StandingObserver(Simulator& simulator);
  /// Counts the vehicles of each driver separately. driver_of_slot: [slots] numbers of drivers, below num_drivers.
  StandingObserver(Simulator& simulator, std::vector<uint8_t> driver_of_slot, size_t num_drivers);

  void after_step(const StepResult& result) override;
  /// Returns the counts of one driver's vehicles in each world. Call it after the last step.
  std::vector<StandingCounts> counts(size_t driver = 0) const;

 private:
  // Step and distance of a vehicle's last progress.
  struct Progress {
    int step = 0;
    float distance_m = 0;
  };

  Simulator& simulator_;
  int step_ = 0;
  std::vector<int32_t> awaited_light_;   // [slots] light at which the vehicle waits, as index in its world; -1: none
  std::vector<Progress> progress_;       // [slots]
  std::vector<uint8_t> driver_of_slot_;  // [slots]
  std::vector<std::vector<StandingCounts>> counts_;  // [drivers][worlds]
};

}  // namespace pictura
