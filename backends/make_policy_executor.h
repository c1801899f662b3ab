// The device-specific parts of a policy, except for weights.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/policy/rules/network_passes.h"
#include "pictura/policy/rules/policy_executor.h"

namespace pictura {

/// Returns why CUDA is unavailable; empty if it is available.
std::string cuda_unavailable_reason();

/// Product name of a device, such as "NVIDIA H100 80GB HBM3" or "host". Throws Error for a device that does not exist.
std::string product_name(Device device);

/// Throws Error for a CUDA device that does not exist.
std::unique_ptr<PolicyExecutor> make_policy_executor(Device device);

/// Throws Error for the host, which has no such passes.
std::unique_ptr<NetworkPasses> make_network_passes(Device device);

}  // namespace pictura
