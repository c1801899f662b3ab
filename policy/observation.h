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

/// Images of the cameras that share one size: planar u8 [batch, cameras of this size, 3, height, width], or patches
/// (common/patches.h) as bf16 [batch, cameras, rows, columns, values of a patch], stored as [cameras, batch, ...].
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
/// Index in EntitySet of kObservationArrays[array_index], for arrays that are sets.
constexpr int entity_set_of(size_t array_index) {
  int set = 0;
  for (size_t i = 0; i < array_index; ++i) set += is_set(kObservationArrays[i]);
  return set;
}
static_assert(entity_set_of(std::size(kObservationArrays)) == kNumEntitySets, "the list and EntitySet have equal sets");

/// Uninitialised storage for the arrays that this configuration's policy reads, [rows, slots, ...].
Observation allocate_observations(const Config& config, int64_t rows, int64_t slots, Device device);

/// Returns one row of observations whose tensors are [rows, ...].
Observation row_of(const Observation& rows, int64_t row);

/// Copies arrays in the memory of `device` to the defined tensors of `out`, [slots, ...], in the same memory. Throws
/// Error naming an array whose size differs from that of its tensor.
void copy_arrays(const ObservationView& view, Device device, const Observation& out);

/// Selects agents from the arrays that this configuration's policy reads, in the memory of `device`. indices: i64 [n],
/// in [0, batch). Throws Error naming an array that does not hold `batch` agents.
Observation select_arrays(const Config& config, const ObservationView& view, Device device, int64_t batch,
                          const at::Tensor& indices);
/// Zeroes the auxiliary slots of vectors (see simulator/observation.h), as in a world without them.
void hide_auxiliary(Observation* observation_inout);

/// Allocates uninitialised memory for images of a rig, [batch..., cameras of one size, 3, height, width].
std::vector<ImageBlock> allocate_images(const Rig& rig, std::vector<int64_t> batch, Device device);

/// Draws the images of these views, [views, ...], in the renderer's memory: as patches if `patch_px` is not 0 and the
/// renderer supports them, else planar.
std::vector<ImageBlock> draw_images(const SceneBatch& scene, Span<const View> views, Renderer* renderer,
                                    int patch_px = 0);

/// Returns the slots, i64 [n] in ascending order, of active agents that the mask [slots] selects (empty: all). With
/// `with_left` it includes agents that in the last step left a road that ends, since the value of their last
/// observation is needed.
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
