#include "pictura/training/observation.h"

#include <chrono>
#include <cstring>

#include "pictura/common/error.h"

namespace pictura {

namespace {

// Without a copy; the caller copies at once.
template <typename T>
at::Tensor wrap(Span<T> span, at::IntArrayRef shape) {
  constexpr at::ScalarType kType = std::is_same_v<std::remove_const_t<T>, float> ? at::kFloat : at::kInt;
  return at::from_blob(const_cast<std::remove_const_t<T>*>(span.data()), shape, at::TensorOptions(kType));
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

std::vector<int64_t> active_slots(Simulator& simulator) {
  const AgentStateView state = simulator.state();
  std::vector<int64_t> slots;
  for (int slot = 0; slot < simulator.num_slots(); ++slot) {
    if (static_cast<AgentStatus>(state.status[slot]) == AgentStatus::active) slots.push_back(slot);
  }
  return slots;
}

Observer::Observer(Simulator* simulator, Renderer* renderer) : simulator_(*simulator), renderer_(renderer) {
  const bool on_host = simulator->device().is_host() && (!renderer || renderer->device().is_host());
  PICTURA_CHECK(on_host,
                "training: simulator '{}' keeps its arrays on a CUDA device, and this build trains on the host: "
                "set simulator.backend to \"cpu\"",
                simulator->name());
}

Observation Observer::allocate(int64_t rows) const {
  const int64_t slots = simulator_.num_slots();
  Observation o;
  o.ego = at::empty({rows, slots, kEgoFeatures}, at::kFloat);
  o.conditioning = at::empty({rows, slots, kNumConditioning}, at::kFloat);
  o.waypoints = at::empty({rows, slots, kNumWaypoints * kWaypointFeatures}, at::kFloat);
  if (renderer_) {
    o.images = image_blocks(renderer_->config().rig, rows, slots);
    return o;
  }
  o.partners = at::empty({rows, slots, kMaxPartners, kPartnerFeatures}, at::kFloat);
  o.lanes = at::empty({rows, slots, kMaxLanes, kLaneFeatures}, at::kFloat);
  o.boundaries = at::empty({rows, slots, kMaxBoundaries, kBoundaryFeatures}, at::kFloat);
  o.controls = at::empty({rows, slots, kMaxControls, kControlFeatures}, at::kFloat);
  o.set_counts = at::empty({rows, slots, kNumEntitySets}, at::kInt);
  return o;
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
  const ObservationView view = simulator_.observations();
  out.ego.copy_(wrap(view.ego, out.ego.sizes()));
  out.conditioning.copy_(wrap(view.conditioning, out.conditioning.sizes()));
  out.waypoints.copy_(wrap(view.waypoints, out.waypoints.sizes()));
  if (!renderer_) {
    out.partners.copy_(wrap(view.partners, out.partners.sizes()));
    out.lanes.copy_(wrap(view.lanes, out.lanes.sizes()));
    out.boundaries.copy_(wrap(view.boundaries, out.boundaries.sizes()));
    out.controls.copy_(wrap(view.controls, out.controls.sizes()));
    out.set_counts.copy_(wrap(view.set_counts, out.set_counts.sizes()));
    return;
  }

  const auto start = std::chrono::steady_clock::now();
  const ImageLayout layout = image_layout(renderer_->config().rig, simulator_.num_slots(), PixelFormat::u8);
  std::vector<CameraImages> cameras;
  for (size_t i = 0; i < layout.cameras.size(); ++i) {
    // Each block is a tensor of its own.
    const CameraLayout& camera = layout.cameras[i];
    const auto block = static_cast<size_t>(camera.block);
    uint8_t* const first = out.images[block].pixels.data_ptr<uint8_t>() + (camera.offset - layout.blocks[block].offset);
    cameras.push_back({camera.size.width_px, camera.size.height_px, first, camera.view_stride});
  }
  const std::vector<int64_t> seeing = active_slots(simulator_);
  std::vector<View> views;
  for (const int64_t slot : seeing) views.push_back(simulator_.views()[static_cast<size_t>(slot)]);
  renderer_->render(simulator_.scene(), views, {Device{}, PixelFormat::u8, static_cast<int>(views.size()), cameras});
  for (const ImageBlock& block : out.images) spread(seeing, block.pixels);
  render_s_ += std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
}

Observation row_of(const Observation& rows, int64_t row) {
  return rows.map([row](const at::Tensor& t) { return t.select(0, row); });
}

}  // namespace pictura
