// Makes controllers that run on the host, by their names.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Names of controllers for maps without a record: "random", "idle" (actions without jerk), "lane" (the lane keeper,
/// see lane_keeping.h), "idm_lanes" (intelligent driver model along lanes, see idm.h).
std::vector<std::string> town_controller_names();
/// Names of controllers for recorded scenes: "log" (agents follow their records), "inverse" (actions that approximate
/// the records, see inverse_actions.h), "idm" (intelligent driver model along recorded paths, see idm.h). On maps
/// without a record, "idm" is the same as "idm_lanes".
std::vector<std::string> record_controller_names();
/// Names of all host controllers.
std::vector<std::string> host_controller_names();
/// Whether a controller runs on the host even if the simulator runs on a device: true for "lane", "idm" and
/// "idm_lanes".
bool drives_on_host(std::string_view name);

/// Throws UsageError if the controller cannot drive in a world; the message names the first such world. "log" and
/// "inverse" need a map with a record. "lane" needs a map without a record, because lanes of recorded scenes end.
void check_worlds(std::string_view controller, const Simulator& simulator);

/// Makes a controller. Throws UsageError, which lists the known names, for an unknown name. Throws Error if the
/// simulator does not work in host memory.
std::unique_ptr<Controller> make_host_controller(const std::string& name, const Simulator& simulator, uint64_t seed);

/// Checks arguments of Controller::act(): `commands` must have one element per slot, the mask must have one element per
/// slot or be empty, and `input` must be in the memory of `device`. Otherwise throws Error, which names the controller
/// `who`.
void check_controller_arrays(std::string_view who, const SimulatorArrays& input, Device device,
                             Span<const uint8_t> mask, Span<const Command> commands);

}  // namespace pictura
