// Mixed traffic: other drivers (controllers or saved policies) drive some of the vehicles.
#pragma once

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluated_driver.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/rule_choices.h"

namespace pictura {

/// Returns the keys of section [simulator.others], in the order of the enum Impairment.
std::vector<std::string> impairment_names();

/// A saved policy, a controller, or the evaluated driver with an impairment. An impaired agent overlooks road users or
/// lights, or brakes without reason.
struct OtherDriver {
  std::string name;  // policy file, town controller or impairment
  double share = 0;  // share of vehicles; for an impairment, of all agents
  Impairment impairment = Impairment::none;
};
constexpr size_t kMaxOtherDrivers = 8;

/// Parses texts such as "lane=0.25", "models/vector.safetensors=0.5" or "blind=0.05". Throws UsageError for another
/// form, a share not above 0, or shares that sum to 1 or more. Throws UsageError for a repeated impairment or too many
/// drivers.
std::vector<OtherDriver> other_drivers(const std::vector<std::string>& texts);

/// Assigns vehicles to drivers. Driver 0 is the evaluated driver.
class MixedTraffic {
 public:
  /// Opens the other drivers with the options' argmax and seed. All drivers use the conditioning of the evaluation's
  /// world. Throws UsageError if an impairment changes observations but the evaluated driver reads none.
  MixedTraffic(const std::vector<OtherDriver>& others, const DriverOptions& options, Device device,
               const CompiledMaps& maps);
  ~MixedTraffic();
  MixedTraffic(const MixedTraffic&) = delete;
  MixedTraffic& operator=(const MixedTraffic&) = delete;

  size_t num_drivers() const;
  /// Empty for driver 0.
  std::string name(size_t driver) const;
  /// For each driver except driver 0, returns the policy hash, or the name of the controller or impairment, and the
  /// share.
  std::vector<std::string> setting() const;
  /// Returns `world` with the observations that any driver reads, and the shares of impaired agents.
  SimulatorConfig adapted(SimulatorConfig world) const;

  /// Returns [slots]: each agent's driver. The draw depends on seed, global world number and agent. Impaired agents of
  /// all classes are drawn first. Driver 0 drives all unimpaired pedestrians and cyclists.
  std::vector<uint8_t> driver_of_slots(Simulator& simulator) const;
  /// Combines `own`, the controller of driver 0, with the other drivers. The simulator must be at the start of its
  /// episodes. This object must outlive the result.
  Driving share(Driving own, Simulator& simulator, const std::vector<uint8_t>& driver_of_slot) const;

 private:
  struct Other;
  size_t impaired_driver(Impairment impairment) const;
  size_t drawn_driver(uint32_t global_world, uint32_t agent) const;

  DriverOptions options_;
  std::vector<std::unique_ptr<Other>> others_;
  double unimpaired_share_ = 1;  // share of agents that are not drawn to be impaired
};

}  // namespace pictura
