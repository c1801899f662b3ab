// Mixed traffic: evaluations in which other drivers (controllers, or saved policies of any kind) drive some of the
// vehicles.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rule_choices.h"

namespace pictura {

/// Returns the names of impairments, in the order of the enum Impairment. These names are the keys of the configuration
/// section [simulator.others].
std::vector<std::string> impairment_names();

/// One of the other drivers: a saved policy, a controller, or the evaluated driver with an impairment. An impaired
/// agent overlooks road users or lights, or brakes for no reason.
struct OtherDriver {
  std::string name;  // a saved policy's file, a name of town_controller_names(), or an impairment
  double share = 0;  // share of vehicles; for an impairment, share of all agents
  Impairment impairment = Impairment::none;  // impairment that `name` denotes, if any
};
constexpr size_t kMaxOtherDrivers = 8;

/// Parses texts like "lane=0.25", "models/vector.safetensors=0.5" or "blind=0.05". Throws UsageError if a text has
/// another form, a share is not above 0, the shares sum to 1 or more, an impairment is given twice, or there are more
/// than kMaxOtherDrivers drivers.
std::vector<OtherDriver> other_drivers(const std::vector<std::string>& texts);

/// Assigns the vehicles of an evaluation's worlds to drivers. Driver 0 is the evaluated driver; the other drivers
/// follow in the order of `others`.
class MixedTraffic {
 public:
  /// Opens the other drivers on `device`, with the options' argmax and seed. Renderers of policies that read images
  /// hold the maps under the handles 0, 1, ... All drivers use the conditioning of the evaluation's world. Throws
  /// UsageError if an impairment changes observations but the evaluated driver is a controller that reads no
  /// observations.
  MixedTraffic(const std::vector<OtherDriver>& others, const DriverOptions& options, Device device,
               const CompiledMaps& maps);
  ~MixedTraffic();
  MixedTraffic(const MixedTraffic&) = delete;
  MixedTraffic& operator=(const MixedTraffic&) = delete;

  size_t num_drivers() const;
  /// Name of the driver; empty for driver 0.
  std::string name(size_t driver) const;
  /// Returns the other drivers' entries in an evaluation's setting: a policy's hash or a controller's name, and the
  /// driver's share.
  std::vector<std::string> setting() const;
  /// Returns `world` with all observation arrays that any driver reads, and with the shares of impaired agents.
  SimulatorConfig adapted(SimulatorConfig world) const;

  /// Returns the driver of each agent slot, [slots]. The random draw depends on the seed, the global world number and
  /// the agent. Impaired agents of all classes are drawn first; then the remaining vehicles are assigned to drivers.
  /// Driver 0 drives all pedestrians and cyclists that are not impaired.
  std::vector<uint8_t> driver_of_slots(Simulator& simulator) const;
  /// Returns a controller that combines `own`, the controller of driver 0, with the other drivers. The simulator must
  /// be at the start of its episodes. This object must outlive the result.
  Driving share(Driving own, Simulator& simulator, const std::vector<uint8_t>& driver_of_slot) const;

 private:
  struct Other;
  size_t impaired_driver(Impairment impairment) const;
  size_t drawn_driver(uint32_t global_world, uint32_t agent) const;

  DriverOptions options_;  // options of the evaluated driver; the others use its argmax and seed
  std::vector<std::unique_ptr<Other>> others_;
};

}  // namespace pictura
