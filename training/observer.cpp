#include "pictura/training/observer.h"

#include <chrono>
#include <cstring>

#include <ATen/core/grad_mode.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/common/support/parallel_for.h"

namespace pictura {

namespace {

// Without a copy; the caller copies at once.
template <typename T>
at::Tensor wrap(Span<T> span, at::IntArrayRef shape) {
  constexpr at::ScalarType kType = std::is_same_v<std::remove_const_t<T>, float> ? at::kFloat : at::kInt;
  return at::from_blob(const_cast<std::remove_const_t<T>*>(span.data()), shape, at::TensorOptions(kType));
}

// Distinct sizes in the order of first appearance, as HostImages has them.
std::vector<ImageBlock> image_blocks(const Rig& rig, int64_t rows, int64_t slots) {
  std::vector<ImageBlock> blocks;
  std::vector<std::pair<int, int>> sizes;
  for (size_t c = 0; c < rig.cameras.size(); ++c) {
    const std::pair size{rig.cameras[c].height_px, rig.cameras[c].width_px};
    size_t block = 0;
    while (block < sizes.size() && sizes[block] != size) ++block;
    if (block == sizes.size()) {
      sizes.push_back(size);
      blocks.emplace_back();
    }
    blocks[block].cameras.push_back(static_cast<int64_t>(c));
  }
  for (size_t b = 0; b < blocks.size(); ++b) {
    blocks[b].pixels = at::empty(
        {rows, slots, static_cast<int64_t>(blocks[b].cameras.size()), 3, sizes[b].first, sizes[b].second}, at::kByte);
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

std::string simulator_name(const std::string& backend) { return backend == "null" ? "cpu" : backend; }

std::unique_ptr<Renderer> make_policy_renderer(const Config& config, const Rig& rig, const Simulator& simulator) {
  RendererConfig renderer_config;
  renderer_config.rig = rig;
  renderer_config.num_threads = config.run.num_threads;
  renderer_config.line_floor_px = static_cast<float>(config.render.line_floor_px);
  std::unique_ptr<Renderer> renderer = make_renderer(config.run.backend, renderer_config);
  upload_geometries(simulator.geometries(), renderer.get());
  return renderer;
}

Observer::Observer(Simulator* simulator, Renderer* renderer) : simulator_(*simulator), renderer_(renderer) {
  const bool on_host = simulator->space() == MemorySpace::host && (!renderer || renderer->device().is_host());
  PICTURA_CHECK(on_host,
                "training: simulator '{}' keeps its arrays on a CUDA device, and this build trains on the host: "
                "set run.backend to \"cpu\"",
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
  std::vector<CameraImages> cameras(renderer_->config().rig.cameras.size());
  for (const ImageBlock& block : out.images) {
    const int64_t height = block.pixels.size(3), width = block.pixels.size(4), image = 3 * height * width;
    for (size_t i = 0; i < block.cameras.size(); ++i) {
      CameraImages& images = cameras[static_cast<size_t>(block.cameras[i])];
      images.width_px = static_cast<int>(width);
      images.height_px = static_cast<int>(height);
      images.data = block.pixels.data_ptr<uint8_t>() + static_cast<int64_t>(i) * image;
      images.view_stride = block.pixels.size(1) * image;
    }
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

Decision decide(const Policy& policy, const Observation& observation, int64_t chunk) {
  const at::NoGradGuard no_grad;
  const int64_t batch = observation.ego.size(0);
  std::vector<at::Tensor> log_probs, values;
  for (int64_t begin = 0; begin < batch; begin += chunk) {
    const int64_t count = std::min(chunk, batch - begin);
    const Policy::Output output =
        policy.forward(observation.map([&](const at::Tensor& t) { return t.narrow(0, begin, count); }));
    log_probs.push_back(at::log_softmax(output.logits, 1));
    values.push_back(output.value);
  }
  return {at::cat(log_probs), at::cat(values)};
}

int32_t draw_action(Span<const float> log_probs, float uniform) {
  double cumulative = 0;
  for (size_t i = 0; i + 1 < log_probs.size(); ++i) {
    cumulative += std::exp(static_cast<double>(log_probs[i]));
    if (uniform < cumulative) return static_cast<int32_t>(i);
  }
  return static_cast<int32_t>(log_probs.size()) - 1;
}

void choose_actions(const at::Tensor& log_probs, const Simulator& simulator, uint64_t seed, bool argmax,
                    Span<int32_t> actions_out) {
  const at::Tensor host = log_probs.contiguous();
  const float* rows = host.const_data_ptr<float>();
  size_t slot = 0;
  for (size_t w = 0; w < simulator.worlds().size(); ++w) {
    const WorldSpec& world = simulator.worlds()[w];
    const auto episode = static_cast<uint32_t>(simulator.episode_index()[w]);
    const auto step = static_cast<uint32_t>(simulator.episode_step()[w]);
    for (int agent = 0; agent < world.num_agents; ++agent, ++slot) {
      const float* row = rows + slot * kNumActions;
      if (argmax) {
        actions_out[slot] = static_cast<int32_t>(std::max_element(row, row + kNumActions) - row);
      } else {
        RandomStream stream({.seed = seed,
                             .world = world.global_world,
                             .agent = static_cast<uint32_t>(agent),
                             .episode = episode,
                             .step = step,
                             .purpose = Purpose::action});
        actions_out[slot] = draw_action({row, kNumActions}, stream.uniform());
      }
    }
  }
}

}  // namespace pictura
