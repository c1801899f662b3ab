// Forward pass of a saved policy on the host, in fp32 and without torch.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pictura/policy/stored_policy.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// Images of cameras of one size: u8 [agents, cameras, 3, height, width].
struct HostImageBlock {
  const uint8_t* pixels = nullptr;
  int64_t height_px = 0, width_px = 0;
  std::vector<int> cameras;  // indices in the rig
};

/// Arrays [agents, rows, features] in the order of PICTURA_OBSERVATION_ARRAYS, and images. Arrays that the policy does
/// not read may be empty.
struct HostObservation {
  int64_t agents = 0;
  ObservationView arrays;
  std::vector<HostImageBlock> images;
};

class HostNetwork {
 public:
  /// Throws Error naming file and parameter if a parameter is missing, not finite, or of another shape. Throws Error
  /// naming the file of policy.backbone if that is a TorchScript program.
  HostNetwork(const StoredPolicy& saved, int num_cameras);
  ~HostNetwork();
  HostNetwork(const HostNetwork&) = delete;
  HostNetwork& operator=(const HostNetwork&) = delete;

  /// Writes logits [agents, kNumActions] and values [agents], equal to those of PolicyNetwork up to the rounding of
  /// sums. num_threads: maximum; 0: all. An agent's result does not depend on other agents. Only one thread may call
  /// this at a time.
  void forward(const HostObservation& observation, int num_threads, float* logits_out, float* values_out) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
