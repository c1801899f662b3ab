// Graphs of work on a CUDA device, which are launched whole instead of call by call.
#pragma once

#include "pictura/common/device.h"

namespace pictura {

/// CUDA graph of what some calls put on a stream, with the addresses and arguments that they had then.
class DeviceGraph {
 public:
  DeviceGraph() = default;
  virtual ~DeviceGraph() = default;
  DeviceGraph(const DeviceGraph&) = delete;
  DeviceGraph& operator=(const DeviceGraph&) = delete;

  /// Launches the graph on a stream. Throws Error where the device cannot.
  virtual void launch(Stream stream) = 0;
};

}  // namespace pictura
