// Makes controllers by name, for simulators on the host and on CUDA devices.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Makes a controller: "random" (uniform actions, keyed by seed, world, agent and step), "idle" (no jerk), "lane" (the
/// lane keeper), and in recorded scenes "log", "inverse" and "idm"; see host_controllers.h. "lane" and "idm" run on the
/// host even if the simulator's memory is on a CUDA device, and their name() states this. The controller serves only
/// this simulator, which must outlive it. Throws UsageError listing the known names.
std::unique_ptr<Controller> make_controller(const std::string& name, Simulator& simulator, uint64_t seed);

}  // namespace pictura
