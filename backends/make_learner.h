// What a learner needs besides what its policy does, for the memory of a device.
#pragma once

#include <functional>
#include <memory>

#include "pictura/common/error_types.h"
#include "pictura/common/scene_history.h"
#include "pictura/training/rules/device_graph.h"
#include "pictura/training/rules/learner_executor.h"

namespace pictura {

/// Throws Error where the device is a CUDA device that there is not.
std::unique_ptr<LearnerExecutor> make_learner_executor(Device device);
std::unique_ptr<SceneHistory> make_scene_history(Device device, const SceneHistorySize& size);

/// What `work` puts on this stream, which must not be the legacy one, as a graph. Nothing is done before it is
/// launched. Throws what `work` throws; Error for the host, and where the work allocates or waits.
std::unique_ptr<DeviceGraph> capture_graph(Device device, Stream stream, const std::function<void()>& work);

}  // namespace pictura
