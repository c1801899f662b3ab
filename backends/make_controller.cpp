#include "pictura/backends/make_controller.h"

#include "pictura/common/error.h"
#include "pictura/simulator/controllers/host_controllers.h"

namespace pictura {

#ifdef PICTURA_HAS_CUDA
std::unique_ptr<Controller> make_cuda_controller(const std::string& name, Device device, uint64_t seed);
#endif

std::unique_ptr<Controller> make_controller(const std::string& name, Simulator& simulator, uint64_t seed) {
#ifdef PICTURA_HAS_CUDA
  const Device device = simulator.controller_input().device;
  if (!device.is_host()) return make_cuda_controller(name, device, seed);
#endif
  return make_host_controller(name, simulator, seed);
}

}  // namespace pictura
