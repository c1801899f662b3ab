// Controllers that run on the host, by name.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Names of controllers for towns: "random", "idle" (no jerk), "lane" (the lane keeper, see lane_keeping.h),
/// "idm_lanes" (along lanes, behind other road users, see idm.h).
std::vector<std::string> town_controller_names();
/// Names of controllers that follow a recorded scene: "log" (as recorded), "inverse" (by the actions that follow the
/// recording, see inverse_actions.h), "idm" (along recorded paths, see idm.h). On towns, "idm" is "idm_lanes".
std::vector<std::string> record_controller_names();
/// Names of all host controllers.
std::vector<std::string> host_controller_names();
/// Whether a controller runs on the host wherever the simulator's memory lies: "lane", "idm" and "idm_lanes" do.
bool drives_on_host(std::string_view name);

/// Throws UsageError naming the first unsuitable world: "log" and "inverse" need a map with a record, and "lane" needs
/// a map without one, because recorded lanes end.
void check_worlds(std::string_view controller, const Simulator& simulator);

/// Makes a controller. Throws UsageError listing the known names, or Error if the simulator's memory is not on the
/// host.
std::unique_ptr<Controller> make_host_controller(const std::string& name, const Simulator& simulator, uint64_t seed);

/// Throws Error naming the controller unless `commands`, and the mask if it is not empty, have one element per slot and
/// the input lies on `device`.
void check_controller_arrays(std::string_view who, const SimulatorArrays& input, Device device,
                             Span<const uint8_t> mask, Span<const Command> commands);

}  // namespace pictura
