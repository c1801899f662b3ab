#include "pictura/backends/make_learner.h"

#include "pictura/backends/make_policy_executor.h"
#include "pictura/common/error.h"

namespace pictura {

// The only public symbol of each executor, declared here so that other files cannot see it.
std::unique_ptr<LearnerExecutor> make_cpu_learner_executor();
#ifdef PICTURA_HAS_CUDA
std::unique_ptr<LearnerExecutor> make_cuda_learner_executor(Device device);
std::unique_ptr<SceneHistory> make_cuda_scene_history(const SceneHistorySize& size, Device device);
std::unique_ptr<NetworkPasses> make_cuda_network_passes(Device device);
std::unique_ptr<DeviceGraph> capture_cuda_graph(Device device, Stream stream, const std::function<void()>& work);
std::string cuda_unavailable();
std::string cuda_product_name(Device device);

std::string cuda_unavailable_reason() { return cuda_unavailable(); }
#else
std::string cuda_unavailable_reason() { return "this build has no CUDA"; }
#endif

namespace {

void check_device(Device device) {
  if (device.is_host()) return;
  const std::string why_not = cuda_unavailable_reason();
  PICTURA_CHECK(why_not.empty(), "learner: {}: {}", name_of(device), why_not);
}

}  // namespace

std::string product_name(Device device) {
  check_device(device);
#ifdef PICTURA_HAS_CUDA
  if (!device.is_host()) return cuda_product_name(device);
#endif
  return "host";
}

std::unique_ptr<LearnerExecutor> make_learner_executor(Device device) {
  check_device(device);
#ifdef PICTURA_HAS_CUDA
  if (!device.is_host()) return make_cuda_learner_executor(device);
#endif
  return make_cpu_learner_executor();
}

std::unique_ptr<PolicyExecutor> make_policy_executor(Device device) { return make_learner_executor(device); }

std::unique_ptr<SceneHistory> make_scene_history(Device device, const SceneHistorySize& size) {
  check_device(device);
#ifdef PICTURA_HAS_CUDA
  if (!device.is_host()) return make_cuda_scene_history(size, device);
#endif
  return make_host_scene_history(size);
}

std::unique_ptr<NetworkPasses> make_network_passes(Device device) {
#ifdef PICTURA_HAS_CUDA
  if (!device.is_host()) return make_cuda_network_passes(device);
#endif
  fail("network passes: none for {}", name_of(device));
}

std::unique_ptr<DeviceGraph> capture_graph(Device device, [[maybe_unused]] Stream stream,
                                           [[maybe_unused]] const std::function<void()>& work) {
#ifdef PICTURA_HAS_CUDA
  if (!device.is_host()) return capture_cuda_graph(device, stream, work);
#endif
  fail("graphs: none for {}", name_of(device));
}

}  // namespace pictura
