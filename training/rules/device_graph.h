// Captured work on a CUDA device.
#pragma once

#include "pictura/common/device.h"

namespace pictura {

/// CUDA graph of captured calls, which keep the addresses and arguments of the capture.
class DeviceGraph {
 public:
  DeviceGraph() = default;
  virtual ~DeviceGraph() = default;
  DeviceGraph(const DeviceGraph&) = delete;
  DeviceGraph& operator=(const DeviceGraph&) = delete;

  /// Throws Error if the device fails.
  virtual void launch(Stream stream) = 0;
};

}  // namespace pictura
