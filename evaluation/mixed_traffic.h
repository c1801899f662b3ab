// Mixed traffic: evaluations in which other saved policies, of any kind, or controllers drive some of the vehicles.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/simulator/compiled_map.h"

namespace pictura {

/// A driver beside the evaluated one.
struct OtherDriver {
  std::string name;  // a saved policy's file, or one of town_controller_names()
  double share = 0;  // of vehicles
};
constexpr size_t kMaxOtherDrivers = 8;

/// Parses texts like "lane=0.25" or "models/vector.safetensors=0.5". Throws UsageError naming a text that has another
/// form, or a share that is not above 0; also if the shares sum to 1 or more, or there are more than kMaxOtherDrivers.
std::vector<OtherDriver> other_drivers(const std::vector<std::string>& texts);

/// Assigns the vehicles of an evaluation's worlds to drivers. Driver 0 is the evaluated one; the others follow in their
/// order.
class MixedTraffic {
 public:
  /// Opens the others on `device`, with argmax and seed of the options. Renderers of those that see images hold the
  /// maps under the handles 0, 1, ... Conditioning is the world's.
  MixedTraffic(const std::vector<OtherDriver>& others, const DriverOptions& options, Device device,
               const CompiledMaps& maps);
  ~MixedTraffic();
  MixedTraffic(const MixedTraffic&) = delete;
  MixedTraffic& operator=(const MixedTraffic&) = delete;

  size_t num_drivers() const;
  /// The driver's name; empty for driver 0.
  std::string name(size_t driver) const;
  /// The others in an evaluation's setting: a policy's hash or a controller's name, and its share.
  std::vector<std::string> setting() const;
  /// The world with every array that some driver reads.
  SimulatorConfig observed(SimulatorConfig world) const;

  /// The driver of each slot, [slots], drawn from seed, global world and agent. Driver 0 has all pedestrians and
  /// cyclists.
  std::vector<uint8_t> driver_of_slots(Simulator& simulator) const;
  /// Combines `own`, driver 0, with the others for a simulator at the start of its episodes. This must outlive the
  /// result.
  Driving share(Driving own, Simulator& simulator, const std::vector<uint8_t>& driver_of_slot) const;

 private:
  struct Other;
  DriverOptions options_;  // of whom is evaluated; others take argmax and seed
  std::vector<std::unique_ptr<Other>> others_;
};

}  // namespace pictura
