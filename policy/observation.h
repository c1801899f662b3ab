// Inputs of a policy as tensors: the simulator's arrays, and images.
#pragma once

#include <memory>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/renderer.h"
#include "pictura/configuration/config.h"
#include "pictura/policy/rules/policy_executor.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Images of the cameras that share one size. `pixels` are planar, u8 [batch, cameras of this size, 3, height, width],
/// or patches (common/patches.h), bf16 [batch, cameras, rows, columns, values of a patch]. The memory of patches has
/// the order [cameras, batch, ...].
struct ImageBlock {
  at::Tensor pixels;
  std::vector<int64_t> cameras;  // indices of these cameras in the rig
};

/// Observations of a batch of agents: the arrays of simulator/observation.h by name, and images. Tensors that the
/// policy does not read are undefined. Entity sets are [batch, rows, features], all others [batch, rows * features].
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

/// Tensors of an Observation in the order of kObservationArrays.
inline constexpr at::Tensor Observation::* kObservationTensors[] = {
#define X(name, type, rows, features, part, comment) &Observation::name,
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

/// Whether an array holds the members of an entity set; set_counts holds their number.
constexpr bool is_set(const ObservationArray& array) {
  return array.part != ObservationPart::own && array.type == ElementType::f32;
}
/// EntitySet of kObservationArrays[array_index], which must be a set.
constexpr int entity_set_of(size_t array_index) {
  int set = 0;
  for (size_t i = 0; i < array_index; ++i) set += is_set(kObservationArrays[i]);
  return set;
}
static_assert(entity_set_of(std::size(kObservationArrays)) == kNumEntitySets, "the list and EntitySet have equal sets");

/// Allocates uninitialised tensors [rows, slots, ...] for the arrays that this configuration's policy reads.
Observation allocate_observations(const Config& config, int64_t rows, int64_t slots, Device device);

/// Returns one row of observations whose tensors are [rows, ...].
Observation row_of(const Observation& rows, int64_t row);

/// Copies arrays to the defined tensors of `out`, [slots, ...]. Arrays and tensors are in the memory of `device`.
/// Throws Error, which names the array, if the size of an array differs from that of its tensor.
void copy_arrays(const ObservationView& view, Device device, const Observation& out);

/// Returns the observations of the agents at `indices`, i64 [n] in [0, batch), for the arrays that this configuration's
/// policy reads. The arrays of `view` are in the memory of `device`. Throws Error, which names the array, if an array
/// does not have `batch` agents.
Observation select_arrays(const Config& config, const ObservationView& view, Device device, int64_t batch,
                          const at::Tensor& indices);
/// Sets all auxiliary features to zero (see simulator/observation.h), as if the simulator did not observe them.
void hide_auxiliary(Observation* observation_inout);

/// Allocates uninitialised memory for images of a rig, [batch..., cameras of one size, 3, height, width].
std::vector<ImageBlock> allocate_images(const Rig& rig, std::vector<int64_t> batch, Device device);

/// Draws the images of these views in the memory of the renderer's device and returns them, [views, ...]. They are
/// patches if `patch_px` is not 0 and the renderer supports patches, else planar.
std::vector<ImageBlock> draw_images(const SceneBatch& scene, Span<const View> views, Renderer* renderer,
                                    int patch_px = 0);

/// Returns the slots of the active agents, i64 [n] in ascending order. A nonempty mask [slots] excludes slots with 0.
/// `with_left` includes agents that left at the end of a road in the last step, because learning needs the value of
/// their last observation.
at::Tensor active_slots(const SimulatorArrays& input, Span<const uint8_t> mask, bool with_left,
                        PolicyExecutor* executor);

/// Views in the memory of a device.
class SelectedViews {
 public:
  SelectedViews(int64_t size, Device device);
  /// Selects the entries of `views` at `indices`, i64 [n].
  SelectedViews(Span<const View> views, Device device, const at::Tensor& indices);
  Span<View> views() const;

 private:
  at::Tensor bytes_;  // u8 [n, sizeof(View)]
};

}  // namespace pictura
