// Implementation of learning_device.h for builds without torch, which compute policies on the host.
#include <cstring>

#include "pictura/common/error.h"
#include "pictura/policy/learning_device.h"

namespace pictura {

Device open_learning_device(const Config& config, int) {
  constexpr const char* kRemedy =
      "this build has no torch, and computes policies on the CPU: install a build "
      "with torch (pip install pictura[train]), or set it to \"cpu\" or \"auto\"";
  PICTURA_CHECK(!config.run.device.starts_with("cuda"), "run.device: \"{}\": {}", config.run.device, kRemedy);
  PICTURA_CHECK(config.simulator.backend != "cuda", "simulator.backend: \"cuda\": {}", kRemedy);
  return {};
}

Stream current_stream(Device) { return {}; }

std::shared_ptr<std::byte> allocate_bytes(size_t bytes, Device) {
  return std::shared_ptr<std::byte>(static_cast<std::byte*>(::operator new(bytes)),
                                    [](std::byte* memory) { ::operator delete(memory); });
}

void set_to_zero(std::byte* memory, size_t bytes, Device) {
  if (bytes > 0) std::memset(memory, 0, bytes);
}

void copy_bytes(std::byte* to, Device, const std::byte* from, Device, size_t bytes) {
  if (bytes > 0) std::memcpy(to, from, bytes);
}

}  // namespace pictura
