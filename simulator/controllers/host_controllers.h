// Creates controllers that run on the host from their names.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Controllers for maps without a record: "random", "idle" (no jerk), "lane" (lane_keeping.h) and "idm_lanes" (idm.h).
std::vector<std::string> town_controller_names();
/// Controllers for recorded scenes: "log" (follows records), "inverse" (inverse_actions.h) and "idm" (idm.h). On maps
/// without a record, "idm" drives as "idm_lanes".
std::vector<std::string> record_controller_names();
std::vector<std::string> host_controller_names();
/// Whether a controller runs on the host even for a simulator on a device.
bool drives_on_host(std::string_view name);

/// Throws UsageError, which names the world, if the controller cannot drive in a world. "log" and "inverse" need a map
/// with a record. "lane" needs a map without a record, because lanes of recorded scenes end.
void check_worlds(std::string_view controller, const Simulator& simulator);

/// Throws UsageError, which lists all names, for an unknown name. Throws Error if the simulator does not work in host
/// memory.
std::unique_ptr<Controller> make_host_controller(const std::string& name, const Simulator& simulator, uint64_t seed);

/// Checks arguments of Controller::act(). Throws Error, which names the controller `who`, for a wrong size or device.
void check_controller_arrays(std::string_view who, const SimulatorArrays& input, Device device,
                             Span<const uint8_t> mask, Span<const Command> commands);

}  // namespace pictura
