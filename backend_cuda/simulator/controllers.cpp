// Controllers in device memory: the rules of simulator/rules/control.h, one thread per slot; and controllers that run
// on the host.
#include <memory>
#include <string>
#include <type_traits>
#include <vector>

#include "pictura/backend_cuda/simulator/kernels.h"
#include "pictura/common/cuda/check.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#include "pictura/common/error.h"
#include "pictura/simulator/agent_state.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/controllers/inverse_actions.h"
#include "pictura/simulator/simulator_setup.h"

namespace pictura {

std::unique_ptr<Controller> make_cuda_controller(const std::string& name, const Simulator& simulator, uint64_t seed);

namespace {

void write(Device device, const auto& rule, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) {
  const DeviceGuard guard(device);
  cuda::launch_commands(rule, static_cast<int32_t>(commands_out.size()), mask.data(), commands_out.data(),
                        static_cast<cudaStream_t>(stream.handle));
  PICTURA_CUDA(cudaGetLastError());
}

class CudaRandomController final : public Controller {
 public:
  CudaRandomController(Device device, uint64_t seed) : device_(device), seed_(seed) {}
  std::string_view name() const override { return "random"; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    check_controller_arrays(name(), input, device_, mask, commands_out);
    write(device_, RandomCommands{seed_, input.slots, input.world_totals}, mask, commands_out, stream);
  }

 private:
  Device device_;
  uint64_t seed_;
};

/// Gives every slot the same command, by a rule without settings; `name` is a literal.
template <typename Rule>
class CudaRuleController final : public Controller {
 public:
  CudaRuleController(std::string_view name, Device device) : name_(name), device_(device) {}
  std::string_view name() const override { return name_; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    check_controller_arrays(name(), input, device_, mask, commands_out);
    write(device_, Rule{}, mask, commands_out, stream);
  }

 private:
  std::string_view name_;
  Device device_;
};

/// Drives by the actions that follow recordings. The host searches these actions and copies them to the device once.
class CudaInverseController final : public Controller {
 public:
  explicit CudaInverseController(const Simulator& simulator) : device_(simulator.device()) {
    const InverseTable table(simulator);
    const DeviceGuard guard(device_);
    worlds_ = DeviceBuffer<ActionTable>(Span<const ActionTable>(table.worlds));
    actions_ = DeviceBuffer<int32_t>(Span<const int32_t>(table.actions));
  }
  std::string_view name() const override { return "inverse"; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    check_controller_arrays(name(), input, device_, mask, commands_out);
    write(device_, TabledCommands{input.slots, input.episode_step, worlds_.span(), actions_.span()}, mask, commands_out,
          stream);
  }

 private:
  Device device_;
  DeviceBuffer<ActionTable> worlds_;
  DeviceBuffer<int32_t> actions_;
};

template <typename T>
void read(Span<T> device, std::vector<std::remove_const_t<T>>* host_out, cudaStream_t stream) {
  host_out->resize(device.size());
  if (device.empty()) return;
  PICTURA_CUDA(
      cudaMemcpyAsync(host_out->data(), device.data(), device.size() * sizeof(T), cudaMemcpyDeviceToHost, stream));
}

/// Runs a controller on the host: in every step, copies its inputs to the host and its commands back.
class CudaHostController final : public Controller {
 public:
  CudaHostController(const Simulator& simulator, std::unique_ptr<Controller> on_host)
      : device_(simulator.device()),
        setup_(simulator.config(), simulator.maps(), simulator.handles(), simulator.worlds()),
        agents_(static_cast<size_t>(setup_.num_slots())),
        on_host_(std::move(on_host)),
        name_(std::string(on_host_->name()) + ", on the host") {}
  std::string_view name() const override { return name_; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream stream) override {
    check_controller_arrays(name(), input, device_, mask, commands_out);
    const DeviceGuard guard(device_);
    const auto cuda_stream = static_cast<cudaStream_t>(stream.handle);
#define X(name, type, per_agent, first, comment) \
  read(Span<const type>(input.state.name, agents_.name.size()), &agents_.name, cuda_stream);
    PICTURA_AGENT_FIELDS(X)
#undef X
    read(input.scene.agents, &boxes_, cuda_stream);
    read(input.scene.light_states, &lights_, cuda_stream);
    read(input.episode_step, &episode_step_, cuda_stream);
    read(input.episode_index, &episode_index_, cuda_stream);
    read(input.seed, &seed_, cuda_stream);
    read(mask, &mask_, cuda_stream);
    read(commands_out, &commands_, cuda_stream);
    PICTURA_CUDA(cudaStreamSynchronize(cuda_stream));

    SimulatorArrays on_host;
    on_host.slots = setup_.slot_table();
    on_host.scene.world_begin = setup_.box_begin;
    on_host.scene.agents = boxes_;
    on_host.scene.light_begin = setup_.light_begin;
    on_host.scene.light_states = lights_;
    on_host.state = agents_.view();
    on_host.episode_step = episode_step_;
    on_host.episode_index = episode_index_;
    on_host.seed = seed_;
    on_host_->act(on_host, mask_, commands_);
    PICTURA_CUDA(cudaMemcpyAsync(commands_out.data(), commands_.data(), commands_.size() * sizeof(Command),
                                 cudaMemcpyHostToDevice, cuda_stream));
    PICTURA_CUDA(cudaStreamSynchronize(cuda_stream));
  }

 private:
  Device device_;
  SimulatorSetup setup_;
  // Copies at addresses that stay valid for the lifetime of this object, because the lane keeper's agents refer to
  // them.
  AgentState agents_;
  std::vector<AgentBox> boxes_;
  std::vector<LightState> lights_;
  std::vector<int32_t> episode_step_, episode_index_;
  std::vector<uint64_t> seed_;
  std::vector<uint8_t> mask_;
  std::vector<Command> commands_;
  std::unique_ptr<Controller> on_host_;
  std::string name_;
};

}  // namespace

std::unique_ptr<Controller> make_cuda_controller(const std::string& name, const Simulator& simulator, uint64_t seed) {
  check_worlds(name, simulator);
  if (name == "random") return std::make_unique<CudaRandomController>(simulator.device(), seed);
  if (name == "idle") return std::make_unique<CudaRuleController<IdleCommands>>("idle", simulator.device());
  if (drives_on_host(name))
    return std::make_unique<CudaHostController>(simulator, make_host_controller(name, simulator, seed));
  if (name == "log") return std::make_unique<CudaRuleController<RecordedCommands>>("log", simulator.device());
  if (name == "inverse") return std::make_unique<CudaInverseController>(simulator);
  fail_usage("controller: expected one of {}; got '{}'", fmt::join(host_controller_names(), ", "), name);
}

}  // namespace pictura
