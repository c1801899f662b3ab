// What a policy needs besides its network's weights, for the memory of a device.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/policy/rules/network_passes.h"
#include "pictura/policy/rules/policy_executor.h"

namespace pictura {

/// Empty where this build and this machine have a CUDA device, else why not.
std::string why_no_cuda_device();

/// What a device is called by its maker, as "NVIDIA H100 80GB HBM3"; "host" for the host. Throws Error where there is
/// no such device.
std::string product_name(Device device);

/// Throws Error where the device is a CUDA device that there is not.
std::unique_ptr<PolicyExecutor> make_policy_executor(Device device);

/// Throws Error for the host, where there are none.
std::unique_ptr<NetworkPasses> make_network_passes(Device device);

}  // namespace pictura
