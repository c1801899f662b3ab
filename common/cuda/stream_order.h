// Dependencies between streams, and numbers of streams in DLPack (a standard for exchanging tensors).
#pragma once

#include <cstdint>

#include "pictura/common/cuda/device_guard.h"

namespace pictura {

/// A DLPack number is 1 (legacy default stream), 2 (per-thread default stream) or a stream's handle.
inline Stream stream_of_number(int64_t number) {
  if (number == 1) return {cudaStreamLegacy};
  if (number == 2) return {cudaStreamPerThread};
  return {reinterpret_cast<void*>(static_cast<intptr_t>(number))};
}
inline int64_t number_of_stream(Stream stream) {
  const auto number = static_cast<int64_t>(reinterpret_cast<intptr_t>(stream.handle));
  return number == 0 ? 1 : number;
}

/// Makes later work on `after` wait for the earlier work on `before`. The call itself does not wait.
inline void order_streams(Device device, Stream before, Stream after) {
  if (number_of_stream(before) == number_of_stream(after)) return;
  const DeviceGuard guard(device);
  cudaEvent_t event = nullptr;
  PICTURA_CUDA(cudaEventCreateWithFlags(&event, cudaEventDisableTiming));
  const cudaError_t recorded = cudaEventRecord(event, static_cast<cudaStream_t>(before.handle));
  const cudaError_t waits =
      recorded == cudaSuccess ? cudaStreamWaitEvent(static_cast<cudaStream_t>(after.handle), event, 0) : recorded;
  cudaEventDestroy(event);  // takes effect after the event has completed
  PICTURA_CUDA(waits);
}

}  // namespace pictura
