#include "pictura/policy/observation.h"

#include "pictura/common/error.h"
#include "pictura/policy/network_shape.h"
#include "pictura/policy/torch_device.h"

namespace pictura {

namespace {

// Returns an array as a tensor with this shape. Throws Error, which names the array, if it has another size.
template <typename T>
at::Tensor checked_tensor(const char* name, Span<T> array, Device device, at::IntArrayRef shape) {
  PICTURA_CHECK(array.size() == static_cast<size_t>(c10::multiply_integers(shape)),
                "observation: {}: expected {} numbers, for {} agents, got {}", name, c10::multiply_integers(shape),
                shape[0], array.size());
  return tensor_over(array, device, shape);
}

std::vector<int64_t> shape_of(const ObservationArray& array, std::vector<int64_t> batch) {
  if (is_set(array))
    batch.insert(batch.end(), {array.rows, array.features});
  else
    batch.push_back(array.rows * array.features);
  return batch;
}

}  // namespace

Observation allocate_observations(const Config& config, int64_t rows, int64_t slots, Device device) {
  Observation result;
  for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
    const ObservationArray& array = kObservationArrays[i];
    if (!config.reads(array.part)) continue;
    const at::TensorOptions options =
        at::TensorOptions(array.type == ElementType::f32 ? at::kFloat : at::kInt).device(torch_device(device));
    result.*kObservationTensors[i] = at::empty(shape_of(array, {rows, slots}), options);
  }
  return result;
}

Observation row_of(const Observation& rows, int64_t row) {
  return rows.map([row](const at::Tensor& t) { return t.select(0, row); });
}

void copy_arrays(const ObservationView& view, Device device, const Observation& out){
#define X(name, type, rows, features, part, comment) \
  if (out.name.defined()) out.name.copy_(checked_tensor(#name, view.name, device, out.name.sizes()));
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
}

Observation select_arrays(const Config& config, const ObservationView& view, Device device, int64_t batch,
                          const at::Tensor& indices) {
  Observation result;
  const ObservationArray* array = kObservationArrays;
#define X(name, type, rows, features, part, comment)                                                            \
  if (config.reads(part)) {                                                                                     \
    result.name = checked_tensor(#name, view.name, device, shape_of(*array, {batch})).index_select(0, indices); \
  }                                                                                                             \
  ++array;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  return result;
}

void hide_auxiliary(Observation* observation_inout) {
  at::Tensor &ego = observation_inout->ego, &partners = observation_inout->partners;
  ego.slice(-1, kSeenEgoFeatures).zero_();
  if (partners.defined()) partners.slice(-1, kSeenPartnerFeatures).zero_();
}

std::vector<ImageBlock> allocate_images(const Rig& rig, std::vector<int64_t> batch, Device device) {
  std::vector<ImageBlock> blocks;
  for (const BlockLayout& block : image_layout(rig, 1, PixelFormat::u8).blocks) {
    std::vector<int64_t> shape = batch;
    shape.insert(shape.end(),
                 {static_cast<int64_t>(block.cameras.size()), 3, block.size.height_px, block.size.width_px});
    blocks.push_back({at::empty(shape, at::TensorOptions(at::kByte).device(torch_device(device))),
                      {block.cameras.begin(), block.cameras.end()}});
  }
  return blocks;
}

namespace {

// Allocates memory for patches of images, stored camera after camera.
std::vector<ImageBlock> allocate_patches(const ImageLayout& layout, Device device) {
  std::vector<ImageBlock> blocks;
  for (const BlockLayout& block : layout.blocks) {
    const at::Tensor pixels =
        at::empty({static_cast<int64_t>(block.cameras.size()), layout.num_views,
                   patches_along(layout.patch_px, block.size.height_px),
                   patches_along(layout.patch_px, block.size.width_px), patch_values(layout.patch_px)},
                  at::TensorOptions(at::kBFloat16).device(torch_device(device)));
    blocks.push_back({pixels.transpose(0, 1), {block.cameras.begin(), block.cameras.end()}});
  }
  return blocks;
}

}  // namespace

std::vector<ImageBlock> draw_images(const SceneBatch& scene, Span<const View> views, Renderer* renderer, int patch_px) {
  const bool as_patches = patch_px > 0 && renderer->draws_all_formats();
  const Rig& rig = renderer->config().rig;
  const auto num_views = static_cast<int64_t>(views.size());
  const PixelFormat format = as_patches ? PixelFormat::bf16 : PixelFormat::u8;
  const ChannelOrder order = as_patches ? ChannelOrder::patches : ChannelOrder::planar;
  const ImageLayout layout = image_layout(rig, num_views, format, order, as_patches ? patch_px : kDefaultPatch_px);
  std::vector<ImageBlock> blocks =
      as_patches ? allocate_patches(layout, renderer->device()) : allocate_images(rig, {num_views}, renderer->device());
  // Each block is a separate tensor. Its strides give the position of the image of a view and a camera.
  std::vector<CameraImages> cameras;
  std::vector<int64_t> num_placed(blocks.size());
  for (const CameraLayout& camera : layout.cameras) {
    const auto block = static_cast<size_t>(camera.block);
    const at::Tensor& pixels = blocks[block].pixels;
    auto* const first = static_cast<std::byte*>(pixels.data_ptr()) +
                        num_placed[block]++ * pixels.stride(1) * static_cast<int64_t>(pixels.element_size());
    cameras.push_back({camera.size.width_px, camera.size.height_px, first, pixels.stride(0)});
  }
  renderer->render(scene, views,
                   {renderer->device(), format, static_cast<int>(num_views), cameras, order, layout.patch_px},
                   current_stream(renderer->device()));
  return blocks;
}

at::Tensor deciding_slots(const SimulatorArrays& input, const DecidingSlots& asked, PolicyExecutor* executor) {
  const auto num_slots = static_cast<int64_t>(input.slots.world_of_slot.size());
  const at::Tensor slots = at::empty({num_slots}, at::TensorOptions(at::kLong).device(torch_device(input.device)));
  return slots.narrow(0, 0, executor->select_deciding(asked, span_of<int64_t>(slots), current_stream(input.device)));
}

at::Tensor active_slots(const SimulatorArrays& input, Span<const uint8_t> mask, bool with_left,
                        PolicyExecutor* executor) {
  return deciding_slots(input, {input.state.status, mask, with_left ? input.state.left : nullptr}, executor);
}

constexpr auto kViewBytes = static_cast<int64_t>(sizeof(View));

SelectedViews::SelectedViews(int64_t size, Device device)
    : bytes_(at::empty({size, kViewBytes}, at::TensorOptions(at::kByte).device(torch_device(device)))) {}

SelectedViews::SelectedViews(Span<const View> views, Device device, const at::Tensor& indices)
    : SelectedViews(indices.size(0), device) {
  const Span<const uint8_t> bytes(reinterpret_cast<const uint8_t*>(views.data()), views.size() * sizeof(View));
  at::index_select_out(bytes_, tensor_over(bytes, device, {static_cast<int64_t>(views.size()), kViewBytes}), 0,
                       indices);
}

Span<View> SelectedViews::views() const {
  return {reinterpret_cast<View*>(bytes_.data_ptr<uint8_t>()), static_cast<size_t>(bytes_.size(0))};
}

}  // namespace pictura
