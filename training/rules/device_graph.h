// Graphs of work on a CUDA device, launched as a whole instead of call by call.
#pragma once

#include "pictura/common/device.h"

namespace pictura {

/// CUDA graph of calls that were captured on a stream. The calls keep the addresses and arguments that they had at
/// capture.
class DeviceGraph {
 public:
  DeviceGraph() = default;
  virtual ~DeviceGraph() = default;
  DeviceGraph(const DeviceGraph&) = delete;
  DeviceGraph& operator=(const DeviceGraph&) = delete;

  /// Launches the graph on a stream. Throws Error if the device fails.
  virtual void launch(Stream stream) = 0;
};

}  // namespace pictura
