// Mixed traffic: evaluations in which other saved policies, of any kind, or controllers drive some of the vehicles.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rule_choices.h"

namespace pictura {

/// Names of impairments, in the order of Impairment: the keys of [simulator.others].
std::vector<std::string> impairment_names();

/// Driver besides the evaluated driver: a policy, a controller, or the evaluated policy itself while impaired.
struct OtherDriver {
  std::string name;  // a saved policy's file, a name of town_controller_names(), or an impairment
  double share = 0;  // share of vehicles; for an impairment, share of all agents
  Impairment impairment = Impairment::none;  // impairment of this name
};
constexpr size_t kMaxOtherDrivers = 8;

/// Parses texts like "lane=0.25", "models/vector.safetensors=0.5" or "blind=0.05". Throws UsageError naming a text of
/// another form, or a share that is not above 0; also if the shares sum to 1 or more, an impairment is given twice, or
/// there are more than kMaxOtherDrivers.
std::vector<OtherDriver> other_drivers(const std::vector<std::string>& texts);

/// Assigns the vehicles of an evaluation's worlds to drivers. Driver 0 is the evaluated driver; the others follow in
/// their order.
class MixedTraffic {
 public:
  /// Opens the other drivers on `device`, with argmax and seed of the options. Renderers of policies with images hold
  /// the maps under the handles 0, 1, ... All drivers have the world's conditioning. Throws UsageError for an
  /// impairment of observations if the evaluated driver is a controller that does not read them.
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
  /// Returns the configuration of the world, extended by all arrays that any of the drivers reads, and by impaired
  /// agents.
  SimulatorConfig adapted(SimulatorConfig world) const;

  /// Returns the driver of each slot, [slots], drawn from seed, global world and agent. Impaired agents, of any class,
  /// are drawn first; then the other vehicles are assigned. Driver 0 drives all pedestrians and cyclists that are not
  /// impaired.
  std::vector<uint8_t> driver_of_slots(Simulator& simulator) const;
  /// Combines `own`, which is driver 0, with the other drivers, for a simulator at the start of its episodes. This
  /// object must outlive the result.
  Driving share(Driving own, Simulator& simulator, const std::vector<uint8_t>& driver_of_slot) const;

 private:
  struct Other;
  size_t impaired_driver(Impairment impairment) const;
  size_t drawn_driver(uint32_t global_world, uint32_t agent) const;

  DriverOptions options_;  // options of the evaluated driver; the others use its argmax and seed
  std::vector<std::unique_ptr<Other>> others_;
};

}  // namespace pictura
