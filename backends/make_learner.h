// Device-specific parts of a learner besides its policy.
#pragma once

#include <functional>
#include <memory>

#include "pictura/common/error_types.h"
#include "pictura/common/scene_history.h"
#include "pictura/training/rules/device_graph.h"
#include "pictura/training/rules/learner_executor.h"

namespace pictura {

/// Makes the executor of a learner. Throws Error if the device is a CUDA device that does not exist.
std::unique_ptr<LearnerExecutor> make_learner_executor(Device device);
std::unique_ptr<SceneHistory> make_scene_history(Device device, const SceneHistorySize& size);

/// Captures as a graph the calls that `work` enqueues on this stream, which must not be the legacy stream. Nothing is
/// executed before the graph is launched. Throws the exceptions of `work`, and Error for the host and for work that
/// allocates or waits.
std::unique_ptr<DeviceGraph> capture_graph(Device device, Stream stream, const std::function<void()>& work);

}  // namespace pictura
