// Inputs of a policy as tensors.
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

/// Images of the cameras of one size. Planar pixels are u8 [batch, cameras of this size, 3, height, width]. Patches
/// (common/patches.h) are bf16 [batch, cameras, rows, columns, values of a patch], in memory [cameras, batch, ...].
struct ImageBlock {
  at::Tensor pixels;
  std::vector<int64_t> cameras;  // indices in the rig
};

/// Observations of a batch: the arrays of simulator/observation.h, and images. Entity sets are [batch, rows, features],
/// others [batch, rows * features]. Tensors that the policy does not read are undefined.
struct Observation {
#define X(name, type, rows, features, part, comment) at::Tensor name;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  std::vector<ImageBlock> images;

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

/// Tensors in the order of kObservationArrays.
inline constexpr at::Tensor Observation::* kObservationTensors[] = {
#define X(name, type, rows, features, part, comment) &Observation::name,
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

/// Allocates uninitialised tensors [rows, slots, ...] for the arrays that the policy reads.
Observation allocate_observations(const Config& config, int64_t rows, int64_t slots, Device device);

Observation row_of(const Observation& rows, int64_t row);

/// Copies arrays to the defined tensors of `out`, [slots, ...]. Throws Error naming an array whose size differs from
/// its tensor's.
void copy_arrays(const ObservationView& view, Device device, const Observation& out);

/// Returns the arrays that the policy reads, for agents at `indices`, i64 [n]. Throws Error naming an array that does
/// not have `batch` agents.
Observation select_arrays(const Config& config, const ObservationView& view, Device device, int64_t batch,
                          const at::Tensor& indices);
/// Sets auxiliary features (simulator/observation.h) to zero.
void hide_auxiliary(Observation* observation_inout);

/// Allocates uninitialised images, [batch..., cameras of one size, 3, height, width].
std::vector<ImageBlock> allocate_images(const Rig& rig, std::vector<int64_t> batch, Device device);

/// Draws these views' images, [views, ...], on the renderer's device. They are patches if `patch_px` is not 0 and the
/// renderer supports it, else planar.
std::vector<ImageBlock> draw_images(const SceneBatch& scene, Span<const View> views, Renderer* renderer,
                                    int patch_px = 0);

/// Returns the slots for which asked(slot) is true, i64 [n], ascending.
at::Tensor deciding_slots(const SimulatorArrays& input, const DecidingSlots& asked, PolicyExecutor* executor);
/// Returns the active agents' slots, i64 [n], ascending. A nonempty mask [slots] excludes slots with 0. `with_left`
/// adds agents that left at the end of a road in the last step, because learning needs their last value.
at::Tensor active_slots(const SimulatorArrays& input, Span<const uint8_t> mask, bool with_left,
                        PolicyExecutor* executor);

/// Views in a device's memory.
class SelectedViews {
 public:
  SelectedViews(int64_t size, Device device);
  /// Selects the views at `indices`, i64 [n].
  SelectedViews(Span<const View> views, Device device, const at::Tensor& indices);
  Span<View> views() const;

 private:
  at::Tensor bytes_;  // u8 [n, sizeof(View)]
};

}  // namespace pictura
