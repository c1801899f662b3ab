// The network of a saved policy on the host, forward alone, in fp32 and without torch: what PolicyNetwork
// (policy/policy.h) computes, within the rounding of sums.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pictura/policy/stored_policy.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// u8 images [agents, cameras, 3, height, width] of the cameras that share one size.
struct HostImageBlock {
  const uint8_t* pixels = nullptr;
  int64_t height_px = 0, width_px = 0;
  std::vector<int> cameras;  // their indices in the rig
};

/// What a batch of agents sees: arrays [agents, rows, features] as PICTURA_OBSERVATION_ARRAYS lists them, of which
/// those that the policy does not read may be empty, and the images of all cameras.
struct HostObservation {
  int64_t agents = 0;
  ObservationView arrays;
  std::vector<HostImageBlock> images;
};

class HostNetwork {
 public:
  /// For a rig of so many cameras. Throws Error naming the file and the first parameter that is missing, of another
  /// shape or not finite, or the program that the policy has in place of convolutions.
  HostNetwork(const StoredPolicy& saved, int num_cameras);
  ~HostNetwork();
  HostNetwork(const HostNetwork&) = delete;
  HostNetwork& operator=(const HostNetwork&) = delete;

  /// Sets logits [agents, kNumActions] and values [agents], over at most num_threads threads (0: all). What comes out
  /// for an agent depends on nothing else in the batch. One call at a time.
  void forward(const HostObservation& observation, int num_threads, float* logits_out, float* values_out) const;

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
