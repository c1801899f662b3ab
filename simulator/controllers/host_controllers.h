// Controllers without a device, by name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Who drives on towns: "random", "idle" (no jerk), "lane" (the lane keeper, see lane_keeping.h), "idm_lanes" (along
/// lanes, behind others, see idm.h).
std::vector<std::string> town_controller_names();
/// Who follows a recorded scene: "log" (as recorded), "inverse" (by the actions that follow the recording, see
/// inverse_actions.h), "idm" (along recorded paths, see idm.h). On towns, "idm" is "idm_lanes".
std::vector<std::string> record_controller_names();
/// Both.
std::vector<std::string> host_controller_names();
/// Whether it drives on the host whatever the simulator's memory: "lane" and both of the intelligent driver do.
bool drives_on_host(std::string_view name);

/// Throws UsageError naming the first world on a map without a record, which "log" and "inverse" cannot drive in; or
/// with one, whose lanes end, which "lane" cannot.
void check_worlds(std::string_view controller, const Simulator& simulator);

/// Throws UsageError listing the known names, or Error where the simulator's memory is not the host's.
std::unique_ptr<Controller> make_host_controller(const std::string& name, const Simulator& simulator, uint64_t seed);

/// Throws Error, naming the controller, unless mask (or nothing) and commands have one element for each slot and the
/// input lies on `device`.
void check_controller_arrays(std::string_view who, const SimulatorArrays& input, Device device,
                             Span<const uint8_t> mask, Span<const Command> commands);

}  // namespace pictura
