// What a policy sees, as tensors: the simulator's arrays and images that are drawn in place.
#pragma once

#include <memory>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/renderer.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/simulator.h"
#include "pictura/training/config.h"

namespace pictura {

/// The images of the cameras that share one size.
struct ImageBlock {
  at::Tensor pixels;             // u8 [batch, cameras of this size, 3, height, width]
  std::vector<int64_t> cameras;  // their indices in the rig
};

/// What a batch of agents sees: the arrays of simulator/observation.h by name, and images. Tensors that the policy does
/// not read are undefined; sets are [batch, rows, features], all others [batch, rows * features].
struct Observation {
#define X(name, type, rows, features, part, comment) at::Tensor name;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  std::vector<ImageBlock> images;

  /// Applies f to every defined tensor.
  template <typename F>
  Observation map(F&& f) const {
    Observation result;
#define X(name, type, rows, features, part, comment) \
  if (name.defined()) result.name = f(name);
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    for (const ImageBlock& block : images) result.images.push_back({f(block.pixels), block.cameras});
    return result;
  }
};

/// Its tensors in the order of kObservationArrays.
inline constexpr at::Tensor Observation::* kObservationTensors[] = {
#define X(name, type, rows, features, part, comment) &Observation::name,
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

/// Whether an array holds the members of an entity set, which set_counts counts.
constexpr bool is_set(const ObservationArray& array) {
  return array.part != ObservationPart::own && array.type == ElementType::f32;
}
/// The number in EntitySet of kObservationArrays[array_index], for arrays that are sets.
constexpr int entity_set_of(size_t array_index) {
  int set = 0;
  for (size_t i = 0; i < array_index; ++i) set += is_set(kObservationArrays[i]);
  return set;
}
static_assert(entity_set_of(std::size(kObservationArrays)) == kNumEntitySets, "the list and EntitySet have equal sets");

/// Uninitialised storage, [rows, slots, ...], for what this configuration's policy reads; images are of the rig.
Observation allocate_observations(const Config& config, const Rig& rig, int64_t rows, int64_t slots);

/// One row of storage whose tensors are [rows, ...].
Observation row_of(const Observation& rows, int64_t row);

/// Copies arrays in host memory to the defined tensors, [slots, ...]. Throws Error naming an array of another size.
void copy_arrays(const ObservationView& view, const Observation& out);

/// Draws the images of some slots, in ascending order, into out.images, [slots, ...]; those of all others are black.
void draw_images(const SceneBatch& scene, Span<const View> views, const std::vector<int64_t>& slots, Renderer* renderer,
                 const Observation& out);

/// Slots whose agents are neither halted nor absent and that the mask has (empty: all), in ascending order.
std::vector<int64_t> active_slots(const ControllerInput& input, Span<const uint8_t> mask = {});

/// From a simulator's present state to the tensors that a policy reads.
class Observer {
 public:
  /// Both must outlive it; policies without images need no renderer. Throws Error when either is on a device that this
  /// build's torch cannot reach.
  Observer(const Config& config, Simulator* simulator, Renderer* renderer);

  /// Uninitialised storage for `rows` observations of all slots, [rows, slots, ...].
  Observation allocate(int64_t rows) const;

  /// Of one such row.
  double bytes_per_row() const;

  /// Writes what every slot sees now into one row of such storage. Images are drawn in place, those of active agents
  /// alone: transitions of the others are not learnt from, and their images are black. (An agent whose episode is cut
  /// off is still active in its final observation, from which its value is bootstrapped.)
  void observe(const Observation& row_out);

  /// Seconds spent drawing so far.
  double render_s() const { return render_s_; }

 private:
  const Config config_;
  Simulator& simulator_;
  Renderer* renderer_;
  double render_s_ = 0;
};

}  // namespace pictura
