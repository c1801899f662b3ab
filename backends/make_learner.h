// What a learner needs besides its network, for the memory of a device.
#pragma once

#include <functional>
#include <memory>
#include <string>

#include "pictura/common/error.h"
#include "pictura/common/scene_history.h"
#include "pictura/training/rules/device_graph.h"
#include "pictura/training/rules/learner_executor.h"
#include "pictura/training/rules/network_passes.h"

namespace pictura {

/// Empty where this build and this machine have a CUDA device, else why not.
std::string why_no_cuda_device();

/// What a device is called by its maker, as "NVIDIA H100 80GB HBM3"; "host" for the host. Throws Error where there is
/// no such device.
std::string product_name(Device device);

/// Throws Error where the device is a CUDA device that there is not.
std::unique_ptr<LearnerExecutor> make_learner_executor(Device device);
std::unique_ptr<SceneHistory> make_scene_history(Device device, const SceneHistorySize& size);

/// Throws Error for the host, where there are none.
std::unique_ptr<NetworkPasses> make_network_passes(Device device);

/// What `work` puts on this stream, which must not be the legacy one, as a graph. Nothing is done before it is
/// launched. Throws what `work` throws; Error for the host, and where the work allocates or waits.
std::unique_ptr<DeviceGraph> capture_graph(Device device, Stream stream, const std::function<void()>& work);

}  // namespace pictura
