#include "pictura/training/observation.h"

#include <chrono>
#include <cstring>

#include "pictura/common/error.h"

namespace pictura {

namespace {

// Copies an array in host memory to a tensor of as many elements, if it is defined.
template <typename T>
void copy_array(const char* name, Span<T> array, const at::Tensor& out) {
  if (!out.defined()) return;
  PICTURA_CHECK(array.size() == static_cast<size_t>(out.numel()),
                "observation: {}: expected {} numbers, for {} agents, got {}", name, out.numel(), out.size(0),
                array.size());
  constexpr at::ScalarType kType = std::is_same_v<std::remove_const_t<T>, float> ? at::kFloat : at::kInt;
  // from_blob takes no pointer to const; the copy reads alone.
  out.copy_(at::from_blob(const_cast<std::remove_const_t<T>*>(array.data()), out.sizes(), at::TensorOptions(kType)));
}

std::vector<ImageBlock> image_blocks(const Rig& rig, int64_t rows, int64_t slots) {
  std::vector<ImageBlock> blocks;
  for (const BlockLayout& block : image_layout(rig, slots, PixelFormat::u8).blocks) {
    const auto cameras = static_cast<int64_t>(block.cameras.size());
    blocks.push_back({at::empty({rows, slots, cameras, 3, block.size.height_px, block.size.width_px}, at::kByte),
                      {block.cameras.begin(), block.cameras.end()}});
  }
  return blocks;
}

// Moves element i of `pixels` [slots, ...] to slots[i], which ascend, and blackens all others. From the end, so that
// nothing is overwritten before it has moved.
void spread(const std::vector<int64_t>& slots, const at::Tensor& pixels) {
  const auto bytes = static_cast<size_t>(pixels.stride(0));
  uint8_t* const first = pixels.data_ptr<uint8_t>();
  auto element = [&](int64_t i) { return first + static_cast<size_t>(i) * bytes; };
  int64_t end = pixels.size(0);
  for (auto i = static_cast<int64_t>(slots.size()); i-- > 0;) {
    const int64_t slot = slots[static_cast<size_t>(i)];
    if (slot != i) std::memcpy(element(slot), element(i), bytes);
    std::memset(element(slot + 1), 0, static_cast<size_t>(end - slot - 1) * bytes);
    end = slot;
  }
  std::memset(first, 0, static_cast<size_t>(end) * bytes);
}

}  // namespace

Observation allocate_observations(const Config& config, const Rig& rig, int64_t rows, int64_t slots) {
  Observation result;
  for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
    const ObservationArray& array = kObservationArrays[i];
    if (!config.reads(array.part)) continue;
    const at::ScalarType type = array.type == ElementType::f32 ? at::kFloat : at::kInt;
    result.*kObservationTensors[i] = is_set(array) ? at::empty({rows, slots, array.rows, array.features}, type)
                                                   : at::empty({rows, slots, array.rows * array.features}, type);
  }
  if (config.reads_images()) result.images = image_blocks(rig, rows, slots);
  return result;
}

Observation row_of(const Observation& rows, int64_t row) {
  return rows.map([row](const at::Tensor& t) { return t.select(0, row); });
}

void copy_arrays(const ObservationView& view, const Observation& out) {
#define X(name, type, rows, features, part, comment) copy_array(#name, view.name, out.name);
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
}

void draw_images(const SceneBatch& scene, Span<const View> views, const std::vector<int64_t>& slots, Renderer* renderer,
                 const Observation& out) {
  const ImageLayout layout = image_layout(renderer->config().rig, out.ego.size(0), PixelFormat::u8);
  std::vector<CameraImages> cameras;
  for (const CameraLayout& camera : layout.cameras) {
    // Each block is a tensor of its own.
    const auto block = static_cast<size_t>(camera.block);
    uint8_t* const first = out.images[block].pixels.data_ptr<uint8_t>() + (camera.offset - layout.blocks[block].offset);
    cameras.push_back({camera.size.width_px, camera.size.height_px, first, camera.view_stride});
  }
  std::vector<View> drawn;
  for (const int64_t slot : slots) drawn.push_back(views[static_cast<size_t>(slot)]);
  renderer->render(scene, drawn, {Device{}, PixelFormat::u8, static_cast<int>(drawn.size()), cameras});
  for (const ImageBlock& block : out.images) spread(slots, block.pixels);
}

std::vector<int64_t> active_slots(const ControllerInput& input, Span<const uint8_t> mask) {
  std::vector<int64_t> slots;
  for (size_t slot = 0; slot < input.slots.world_of_slot.size(); ++slot) {
    const bool is_active = static_cast<AgentStatus>(input.state.status[slot]) == AgentStatus::active;
    if (is_active && (mask.empty() || mask[slot])) slots.push_back(static_cast<int64_t>(slot));
  }
  return slots;
}

Observer::Observer(const Config& config, Simulator* simulator, Renderer* renderer)
    : config_(config), simulator_(*simulator), renderer_(renderer) {
  PICTURA_CHECK(!config.reads_images() || renderer, "training: a policy that reads images needs a renderer");
  const Device device = simulator->controller_input().device;
  PICTURA_CHECK(
      device.is_host() && (!renderer || renderer->device().is_host()),
      "training: simulator '{}' works on {} and this build learns on the host: set simulator.backend to \"cpu\"",
      simulator->name(), name_of(device));
}

Observation Observer::allocate(int64_t rows) const {
  return allocate_observations(config_, renderer_ ? renderer_->config().rig : Rig{}, rows, simulator_.num_slots());
}

double Observer::bytes_per_row() const {
  double bytes = 0;
  allocate(0).map([&](const at::Tensor& t) {
    double row = static_cast<double>(t.element_size());
    for (const int64_t size : t.sizes().slice(1)) row *= static_cast<double>(size);
    bytes += row;
    return t;
  });
  return bytes;
}

void Observer::observe(const Observation& out) {
  const ControllerInput input = simulator_.controller_input();
  copy_arrays(input.observations, out);
  if (!config_.reads_images()) return;
  const auto start = std::chrono::steady_clock::now();
  draw_images(input.scene, input.views, active_slots(input), renderer_, out);
  render_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

}  // namespace pictura
