// What a policy sees, as tensors: the simulator's arrays and images that are drawn in place.
#pragma once

#include <memory>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// The images of the cameras that share one size.
struct ImageBlock {
  at::Tensor pixels;             // u8 [batch, cameras of this size, 3, height, width]
  std::vector<int64_t> cameras;  // their indices in the rig
};

/// What a batch of agents sees. Tensors that the policy does not read are undefined.
struct Observation {
  at::Tensor ego;                                    // [batch, kEgoFeatures]
  at::Tensor conditioning;                           // [batch, kNumConditioning]
  at::Tensor waypoints;                              // [batch, kNumWaypoints * kWaypointFeatures]
  at::Tensor partners, lanes, boundaries, controls;  // [batch, members, features]
  at::Tensor set_counts;                             // i32 [batch, kNumEntitySets]
  std::vector<ImageBlock> images;

  /// Applies f to every defined tensor.
  template <typename F>
  Observation map(F&& f) const {
    Observation result;
    at::Tensor Observation::* const tensors[] = {
        &Observation::ego,   &Observation::conditioning, &Observation::waypoints, &Observation::partners,
        &Observation::lanes, &Observation::boundaries,   &Observation::controls,  &Observation::set_counts};
    for (const auto tensor : tensors) {
      if ((this->*tensor).defined()) result.*tensor = f(this->*tensor);
    }
    for (const ImageBlock& block : images) result.images.push_back({f(block.pixels), block.cameras});
    return result;
  }
};

/// One row of storage whose tensors are [rows, ...].
Observation row_of(const Observation& rows, int64_t row);

/// Slots whose agents are neither halted nor absent, in ascending order.
std::vector<int64_t> active_slots(Simulator& simulator);

/// From a simulator's present state to the tensors that a policy reads.
class Observer {
 public:
  /// Both must outlive it; without a renderer the observation is the vector one. Throws Error when either is on a
  /// device that this build's torch cannot reach.
  Observer(Simulator* simulator, Renderer* renderer);

  /// Uninitialised storage for `rows` observations of all slots, [rows, slots, ...].
  Observation allocate(int64_t rows) const;

  /// Of one such row.
  double bytes_per_row() const;

  /// Writes what every slot sees now into one row of such storage. Images are drawn in place, those of active agents
  /// alone: nobody learns from what the others see, and theirs are black. (An agent whose episode is cut off is still
  /// active in its final observation, from which its value is bootstrapped.)
  void observe(const Observation& row_out);

  /// Seconds spent drawing so far.
  double render_s() const { return render_s_; }

 private:
  Simulator& simulator_;
  Renderer* renderer_;
  double render_s_ = 0;
};

}  // namespace pictura
