// Creates controllers from their names.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Makes a controller by a name of host_controllers.h. Controllers with drives_on_host() run on the host even if the
/// simulator is on a CUDA device. Random actions are keyed by seed, world, agent and step. The simulator must outlive
/// the controller. Throws UsageError if the name is unknown (the message lists the known names), or if the controller
/// cannot drive in one of the simulator's worlds.
std::unique_ptr<Controller> make_controller(const std::string& name, Simulator& simulator, uint64_t seed);

}  // namespace pictura
