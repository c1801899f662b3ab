// The rig's sizes as compile-time constants. Kernels built at run time get these macros from KernelTarget. 0 means that
// the size is read from the task.
#pragma once

#include "pictura/backend_cuda/renderer/kernel_arguments.h"

#ifndef PICTURA_RIG_CAMERAS
#define PICTURA_RIG_CAMERAS 0
#define PICTURA_RIG_WIDTH_PX 0  // 0 unless all cameras have the same size
#define PICTURA_RIG_HEIGHT_PX 0
#define PICTURA_RANDOMIZES_CAMERAS 1
#endif

namespace pictura::cuda {

__device__ inline int num_cameras(const DrawTask& task) {
  return PICTURA_RIG_CAMERAS > 0 ? PICTURA_RIG_CAMERAS : task.num_cameras;
}
__device__ inline int width_px(const PinholeCamera& camera) {
  return PICTURA_RIG_WIDTH_PX > 0 ? PICTURA_RIG_WIDTH_PX : camera.width_px;
}
__device__ inline int height_px(const PinholeCamera& camera) {
  return PICTURA_RIG_HEIGHT_PX > 0 ? PICTURA_RIG_HEIGHT_PX : camera.height_px;
}
constexpr bool kRandomizesCameras = PICTURA_RANDOMIZES_CAMERAS != 0;

}  // namespace pictura::cuda
