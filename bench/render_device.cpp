#include "pictura/bench/render_device.h"

#include <algorithm>
#include <chrono>
#include <fstream>
#include <sstream>

#include <fmt/format.h>

#include "pictura/common/cuda/device_scene.h"

namespace pictura {

namespace {

std::size_t free_bytes() {
  std::size_t free = 0, total = 0;
  PICTURA_CUDA(cudaMemGetInfo(&free, &total));
  return free;
}

class DeviceTarget final : public RenderTarget {
 public:
  DeviceTarget(const DrivenWorlds& worlds, const RenderCase& render_case)
      : render_case_(render_case), scene_(worlds.simulator->scene()) {
    views_ = view_copy_.assign({worlds.views.data(), static_cast<std::size_t>(render_case.num_views)}, nullptr);
    // A host image of each camera defines the sizes and planes.
    HostImages one = images_of(render_case, 1);
    ImageBatch shape = one.batch();
    shape.num_views = render_case.num_views;
    batch_ = staged_.like(shape);
    PICTURA_CUDA(cudaEventCreate(&begin_));
    PICTURA_CUDA(cudaEventCreate(&end_));
    PICTURA_CUDA(cudaDeviceSynchronize());
  }
  ~DeviceTarget() override {
    cudaEventDestroy(begin_);
    cudaEventDestroy(end_);
  }
  DeviceTarget(const DeviceTarget&) = delete;
  DeviceTarget& operator=(const DeviceTarget&) = delete;

  void fill_unwritten() override {
    visit_memory(batch_, [](void* first, std::size_t stride_bytes, std::size_t row_bytes, std::size_t rows) {
      PICTURA_CUDA(cudaMemset2D(first, stride_bytes, kUnwrittenByte, row_bytes, rows));
    });
    PICTURA_CUDA(cudaDeviceSynchronize());
  }
  double draw(Renderer* renderer, int calls) override {
    PICTURA_CUDA(cudaEventRecord(begin_));
    for (int call = 0; call < calls; ++call) renderer->render(scene_.batch(), views_, batch_);
    PICTURA_CUDA(cudaEventRecord(end_));
    PICTURA_CUDA(cudaEventSynchronize(end_));
    float total_ms = 0;
    PICTURA_CUDA(cudaEventElapsedTime(&total_ms, begin_, end_));
    return static_cast<double>(total_ms) / calls;
  }
  const HostImages& images(int num_views) override {
    on_host_ = std::make_unique<HostImages>(images_of(render_case_, num_views));
    staged_.copy_to_host(on_host_->batch());
    PICTURA_CUDA(cudaDeviceSynchronize());
    return *on_host_;
  }

 private:
  RenderCase render_case_;
  DeviceScene scene_;
  DeviceUpload<View> view_copy_;
  Span<const View> views_;
  DeviceImages staged_;
  ImageBatch batch_;
  std::unique_ptr<HostImages> on_host_;
  cudaEvent_t begin_ = nullptr, end_ = nullptr;
};

}  // namespace

std::unique_ptr<RenderTarget> make_device_target(const DrivenWorlds& worlds, const RenderCase& render_case) {
  return std::make_unique<DeviceTarget>(worlds, render_case);
}

DeviceMemoryMeter::DeviceMemoryMeter() : free_before_(free_bytes()) {
  poller_ = std::thread([this] {
    while (!stops_) {
      std::size_t free = 0, total = 0;
      status_ = cudaMemGetInfo(&free, &total);
      if (status_ != cudaSuccess) return;
      max_bytes_ = std::max(max_bytes_.load(), static_cast<double>(free_before_) - static_cast<double>(free));
      std::this_thread::sleep_for(std::chrono::microseconds(200));
    }
  });
}

DeviceMemoryMeter::~DeviceMemoryMeter() {
  stops_ = true;
  poller_.join();
}

double DeviceMemoryMeter::used_bytes() const {
  return static_cast<double>(free_before_) - static_cast<double>(free_bytes());
}

double DeviceMemoryMeter::max_bytes() const {
  check_cuda(status_, "cudaMemGetInfo of DeviceMemoryMeter");
  return std::max(max_bytes_.load(), used_bytes());
}

std::string cuda_device_name() {
  cudaDeviceProp properties{};
  if (cudaGetDeviceProperties(&properties, 0) == cudaSuccess) return properties.name;
  cudaGetLastError();  // clears the error for the next call
  return "";
}

std::string cuda_driver_name() {
  int version = 0;
  if (cudaDriverGetVersion(&version) != cudaSuccess || version == 0) return "";
  std::string text = fmt::format("CUDA {}.{}", version / 1000, version % 1000 / 10);
  // The first line is "NVRM version: NVIDIA UNIX x86_64 Kernel Module  580.95.05  ..."
  std::ifstream in("/proc/driver/nvidia/version");
  std::string line, word;
  std::getline(in, line);
  for (std::istringstream words(line); words >> word;) {
    const bool is_version = word.find('.') != std::string::npos && word.find_first_not_of("0123456789.") == word.npos;
    if (is_version) return fmt::format("{}, {}", word, text);
  }
  return text;
}

}  // namespace pictura
