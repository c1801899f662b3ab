#include "pictura/training/kernel_profile.h"

#include <algorithm>
#include <map>

#include <torch/csrc/autograd/profiler_kineto.h>

namespace pictura {

namespace profiler = torch::profiler::impl;

void KernelProfile::begin() {
  const profiler::ProfilerConfig config(profiler::ProfilerState::KINETO);
  const std::set<profiler::ActivityType> activities{profiler::ActivityType::CUDA};
  torch::autograd::profiler::prepareProfiler(config, activities);
  torch::autograd::profiler::enableProfiler(config, activities);
}

std::vector<KernelTime> KernelProfile::end() {
  const auto result = torch::autograd::profiler::disableProfiler();
  std::map<std::string, KernelTime> by_name;
  for (const torch::autograd::profiler::KinetoEvent& event : result->events()) {
    if (event.deviceType() != at::kCUDA) continue;
    KernelTime& kernel = by_name[event.name()];
    ++kernel.launches;
    kernel.seconds += 1e-9 * static_cast<double>(event.durationNs());
  }
  std::vector<KernelTime> kernels;
  for (auto& [name, kernel] : by_name) {
    kernel.name = name;
    kernels.push_back(std::move(kernel));
  }
  std::sort(kernels.begin(), kernels.end(), [](const auto& a, const auto& b) { return a.seconds > b.seconds; });
  return kernels;
}

}  // namespace pictura
