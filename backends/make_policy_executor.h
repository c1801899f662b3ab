// The device-specific parts of a policy, except for its network's weights.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/policy/rules/network_passes.h"
#include "pictura/policy/rules/policy_executor.h"

namespace pictura {

/// Empty if this build supports CUDA and this machine has a CUDA device, else the reason.
std::string cuda_unavailable_reason();

/// Product name of a device, such as "NVIDIA H100 80GB HBM3"; "host" for the host. Throws Error for a device that does
/// not exist.
std::string product_name(Device device);

/// Makes the executor of a policy. Throws Error if the device is a CUDA device that does not exist.
std::unique_ptr<PolicyExecutor> make_policy_executor(Device device);

/// Makes the executor of forward and backward passes of a network. Throws Error for the host, which has no such
/// executor.
std::unique_ptr<NetworkPasses> make_network_passes(Device device);

}  // namespace pictura
