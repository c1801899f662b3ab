// Mixed traffic: vehicles that others drive than whom an evaluation is of, saved policies of any kind or controllers.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// One of the others.
struct OtherDriver {
  std::string name;  // a saved policy's file, or one of town_controller_names()
  double share = 0;  // of vehicles
};
constexpr size_t kMaxOtherDrivers = 8;

/// Others of texts like "lane=0.25" or "models/vector.safetensors=0.5". Throws UsageError naming the text that is not
/// of this form, or whose share is not above 0; or where all shares together leave nobody, or there are more than
/// kMaxOtherDrivers.
std::vector<OtherDriver> other_drivers(const std::vector<std::string>& texts);

/// Who drives which vehicles of an evaluation's worlds. Drivers are numbered: 0 is whom the evaluation is of, others
/// follow in their order.
class MixedTraffic {
 public:
  /// Others drive on `device`, by argmax and seed of the options; those who see images get the maps as 0, 1, ... What
  /// agents are told is the world's.
  MixedTraffic(const std::vector<OtherDriver>& others, const DriverOptions& options, Device device,
               const CompiledMaps& maps);
  ~MixedTraffic();
  MixedTraffic(const MixedTraffic&) = delete;
  MixedTraffic& operator=(const MixedTraffic&) = delete;

  size_t num_drivers() const;
  /// The driver's name; empty for number 0.
  std::string name(size_t driver) const;
  /// What of an evaluation's setting the others are: a policy's hash or a controller's name, and its share.
  std::vector<std::string> setting() const;
  /// The world in which all drivers observe what they read.
  SimulatorConfig observed(SimulatorConfig world) const;

  /// The number of the driver of each slot, [slots], drawn by seed, global world and agent. Pedestrians and cyclists
  /// are number 0's.
  std::vector<uint8_t> driver_of_slots(Simulator& simulator) const;
  /// The simulator's drivers at the start of its episodes, of whom `own` is number 0. The result needs this.
  Driving share(Driving own, Simulator& simulator, const std::vector<uint8_t>& driver_of_slot) const;

 private:
  struct Other;
  uint64_t seed_;
  std::vector<std::unique_ptr<Other>> others_;
};

}  // namespace pictura
