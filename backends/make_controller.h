// Controllers by name, for the memory that a simulator works in.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// "random" (uniform actions, keyed by seed, world, agent and step), "idle" (no jerk), "lane" (the lane keeper), and in
/// recorded scenes "log", "inverse" and "idm"; see host_controllers.h. "lane" and "idm" drive on the host whatever the
/// simulator's memory, and say so in their name(). The controller drives this simulator alone, which must outlive it.
/// Throws UsageError listing the known names.
std::unique_ptr<Controller> make_controller(const std::string& name, Simulator& simulator, uint64_t seed);

}  // namespace pictura
