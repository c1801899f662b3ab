// Work on a CUDA device that is launched whole instead of call by call.
#pragma once

#include "pictura/common/device.h"

namespace pictura {

/// A CUDA graph: what some calls put on a stream, with the addresses and the arguments that they had then.
class DeviceGraph {
 public:
  DeviceGraph() = default;
  virtual ~DeviceGraph() = default;
  DeviceGraph(const DeviceGraph&) = delete;
  DeviceGraph& operator=(const DeviceGraph&) = delete;

  /// Puts all of it on a stream. Throws Error where the device cannot.
  virtual void launch(Stream stream) = 0;
};

}  // namespace pictura
