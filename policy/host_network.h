// Forward pass of a saved policy on the host, in fp32 and without torch. Its outputs equal those of PolicyNetwork
// (policy/policy.h) up to the rounding of sums.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pictura/policy/stored_policy.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// Images of the cameras that share one size: u8 [agents, cameras, 3, height, width].
struct HostImageBlock {
  const uint8_t* pixels = nullptr;
  int64_t height_px = 0, width_px = 0;
  std::vector<int> cameras;  // indices of these cameras in the rig
};

/// Observations of a batch of agents: arrays [agents, rows, features] in the order of PICTURA_OBSERVATION_ARRAYS, and
/// images of all cameras. Arrays that the policy does not read may be empty.
struct HostObservation {
  int64_t agents = 0;
  ObservationView arrays;
  std::vector<HostImageBlock> images;
};

class HostNetwork {
 public:
  /// Reads the parameters of a policy with `num_cameras` cameras. Throws Error, which names the file and the parameter,
  /// if a parameter is missing, has another shape or is not finite. Throws Error, which names the program, if a
  /// pretrained TorchScript program replaces the policy's convolutions (policy.backbone).
  HostNetwork(const StoredPolicy& saved, int num_cameras);
  ~HostNetwork();
  HostNetwork(const HostNetwork&) = delete;
  HostNetwork& operator=(const HostNetwork&) = delete;

  /// Writes logits [agents, kNumActions] and values [agents], on at most num_threads threads (0: all). The result of an
  /// agent does not depend on the other agents. Only one thread may call this at a time.
  void forward(const HostObservation& observation, int num_threads, float* logits_out, float* values_out) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
