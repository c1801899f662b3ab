// The device-specific parts of a learner, except for its policy.
#pragma once

#include <functional>
#include <memory>

#include "pictura/common/error_types.h"
#include "pictura/common/scene_history.h"
#include "pictura/training/rules/device_graph.h"
#include "pictura/training/rules/learner_executor.h"

namespace pictura {

/// Throws Error for a CUDA device that does not exist.
std::unique_ptr<LearnerExecutor> make_learner_executor(Device device);
std::unique_ptr<SceneHistory> make_scene_history(Device device, const SceneHistorySize& size);

/// Captures the calls that `work` enqueues on `stream` as a CUDA graph, without executing them. `stream` must not be
/// the legacy default stream. Throws the exceptions of `work`, and Error if the device is the host, or if `work`
/// allocates or waits.
std::unique_ptr<DeviceGraph> capture_graph(Device device, Stream stream, const std::function<void()>& work);

}  // namespace pictura
