// Controllers in device memory: the rules of simulator/rules/control.h, a thread a slot.
#include <memory>
#include <string>

#include "pictura/backend_cuda/simulator/kernels.h"
#include "pictura/common/cuda/check.h"
#include "pictura/common/error.h"
#include "pictura/simulator/controllers/host_controllers.h"

namespace pictura {

std::unique_ptr<Controller> make_cuda_controller(const std::string& name, Device device, uint64_t seed);

namespace {

void write(const auto& rule, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) {
  cuda::launch_commands(rule, static_cast<int32_t>(commands_out.size()), mask.data(), commands_out.data(),
                        static_cast<cudaStream_t>(stream.handle));
  PICTURA_CUDA(cudaGetLastError());
}

class CudaRandomController final : public Controller {
 public:
  CudaRandomController(Device device, uint64_t seed) : device_(device), seed_(seed) {}
  std::string_view name() const override { return "random"; }
  void act(const ControllerInput& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    check_controller_arrays(name(), input, device_, mask, commands_out);
    write(RandomCommands{seed_, input.slots, input.world_totals}, mask, commands_out, stream);
  }

 private:
  Device device_;
  uint64_t seed_;
};

class CudaIdleController final : public Controller {
 public:
  explicit CudaIdleController(Device device) : device_(device) {}
  std::string_view name() const override { return "idle"; }
  void act(const ControllerInput& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    check_controller_arrays(name(), input, device_, mask, commands_out);
    write(IdleCommands{}, mask, commands_out, stream);
  }

 private:
  Device device_;
};

}  // namespace

std::unique_ptr<Controller> make_cuda_controller(const std::string& name, Device device, uint64_t seed) {
  if (name == "random") return std::make_unique<CudaRandomController>(device, seed);
  if (name == "idle") return std::make_unique<CudaIdleController>(device);
  fail_usage("controller: expected random or idle in device memory; got '{}'", name);
}

}  // namespace pictura
