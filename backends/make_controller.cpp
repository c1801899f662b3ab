#include "pictura/backends/make_controller.h"

#include "pictura/common/error.h"
#include "pictura/simulator/controllers/host_controllers.h"

namespace pictura {

#ifdef PICTURA_HAS_CUDA
std::unique_ptr<Controller> make_cuda_controller(const std::string& name, const Simulator& simulator, uint64_t seed);
#endif

std::unique_ptr<Controller> make_controller(const std::string& name, Simulator& simulator, uint64_t seed) {
#ifdef PICTURA_HAS_CUDA
  if (!simulator.device().is_host()) return make_cuda_controller(name, simulator, seed);
#endif
  return make_host_controller(name, simulator, seed);
}

}  // namespace pictura
