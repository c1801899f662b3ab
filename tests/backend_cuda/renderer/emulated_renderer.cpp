#include "pictura/tests/backend_cuda/renderer/emulated_renderer.h"

#include <algorithm>
#include <utility>

#include "pictura/backend_cuda/renderer/draw_task.h"
#include "pictura/backend_cuda/renderer/scratch_buffers.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"
// Include this last, because it redefines CUDA's keywords.
#include "pictura/tests/backend_cuda/emulated_device.h"
// The kernels are renamed, because the same program contains the kernels compiled ahead of time.
#define pictura_cull emulated_cull
#define pictura_setup_faces emulated_setup_faces
#define pictura_clip emulated_clip
#define pictura_draw emulated_draw
#define pictura_draw_deferred emulated_draw_deferred
#define pictura_draw_overflow emulated_draw_overflow
#define pictura_visibility emulated_visibility
#include "pictura/backend_cuda/renderer/kernels.cuh"

namespace pictura {

namespace cuda {
// Shared memory of the running block.
alignas(16) unsigned char block_memory[232448];
}  // namespace cuda

namespace test {

namespace {
constexpr int kBlocks = 2;
template <typename Value>
using HostBuffer = std::vector<Value>;
}  // namespace

struct EmulatedRenderer::Map {
  StaticGeometry geometry;
  cuda::SortedPieces strips, walls;
  explicit Map(const StaticGeometry& map) : geometry(map), strips(geometry.strips), walls(geometry.walls) {}
};

// Contents of a CUDA renderer's device memory.
struct EmulatedRenderer::Setup {
  cuda::DrawTask task;
  cuda::DrawCounters counters;
  cuda::FaultWord fault = cuda::kNoFault;
  cuda::PoolBuffers<HostBuffer> pool;
  cuda::OverflowBuffers<HostBuffer> large;

  Setup(const EmulatedRenderer& renderer, const cuda::DrawTask& draw, const SceneBatch& scene) : task(draw) {
    int pieces = 0, heads = 0;
    for (const auto& kept : renderer.maps_) {
      if (!kept) continue;
      const StaticGeometry& map = kept->geometry;
      heads = std::max(heads, static_cast<int>(map.heads.size()));
      pieces = std::max(pieces, static_cast<int>(map.strips.size() + map.walls.size() + map.heads.size()));
    }
    const auto images = static_cast<std::size_t>(task.num_views * task.num_cameras);
    const std::size_t faces = renderer.pool_.faces * images;
    pool = cuda::PoolBuffers<HostBuffer>({images, faces, 4 * faces + renderer.pool_.clipped_edges * images});
    pool.serve(&task);
    task.geometries = renderer.geometries_.data();
    task.num_geometries = static_cast<int32_t>(renderer.geometries_.size());
    task.counters = &counters;
    task.fault = &fault;
    cuda::choose_tiles(&task, kBlocks);
    cuda::Scratch sizes = cuda::overflow_sizes(pieces, heads, scene.agents.size());
    sizes.blocks = kBlocks;
    large = cuda::OverflowBuffers<HostBuffer>(sizes, cuda::large_bytes(sizes));
  }
  Setup(const Setup&) = delete;
};

EmulatedRenderer::EmulatedRenderer(const RendererConfig& config, uint64_t seed)
    : EmulatedRenderer(config, seed, Pool{}) {}
EmulatedRenderer::EmulatedRenderer(const RendererConfig& config, uint64_t seed, const Pool& pool)
    : config_(config), seed_(seed), pool_(pool), cameras_(pinhole_cameras(config.rig)) {}
EmulatedRenderer::~EmulatedRenderer() = default;

void EmulatedRenderer::upload(GeometryHandle handle, const StaticGeometry& geometry, Stream) {
  const auto index = static_cast<std::size_t>(handle);
  if (index >= maps_.size()) {
    maps_.resize(index + 1);
    geometries_.resize(index + 1, cuda::empty_entry());
  }
  maps_[index] = std::make_unique<Map>(geometry);
  const Map& map = *maps_[index];
  geometries_[index] = {map.geometry.view(), map.strips.view(), map.walls.view()};
}

void EmulatedRenderer::release(GeometryHandle handle, Stream) {
  const auto index = static_cast<std::size_t>(handle);
  if (index >= maps_.size()) return;
  maps_[index].reset();
  geometries_[index] = cuda::empty_entry();
}

template <typename Kernel>
void EmulatedRenderer::launch(int threads, unsigned blocks, Kernel&& kernel) const {
  emulation::launch(threads, blocks, seed_, cuda::block_memory, kernel);
}

void EmulatedRenderer::render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out, Stream) {
  Setup setup(*this, cuda::make_draw_task(config_, cameras_, scene, views, &images_out), scene);
  cuda::DrawTask& task = setup.task;
  launch(cuda::kSetupThreads, kBlocks, [&] { cuda::emulated_cull(task); });
  launch(cuda::kSetupThreads, kBlocks, [&] { cuda::emulated_setup_faces(task); });
  launch(cuda::kSetupThreads, kBlocks, [&] { cuda::emulated_clip(task); });
  launch(cuda::kDrawThreads, kBlocks, [&] { cuda::emulated_draw(task); });
  deferred_ = setup.counters.deferred;
  const int deferred_blocks = cuda::setup_blocks(task.pool, kBlocks);
  launch(cuda::kDrawThreads, static_cast<unsigned>(deferred_blocks), [&] { cuda::emulated_draw_deferred(task); });
  overflow_ = setup.counters.overflow;
  launch(cuda::kLargeThreads, kBlocks, [&] { cuda::emulated_draw_overflow(task, setup.large.view()); });
  fault_ = setup.fault;
}

void EmulatedRenderer::visibility(const SceneBatch& scene, const ViewBatch& views, Span<const VisibilityQuery> queries,
                                  Span<float> visibility_out, Stream) {
  Setup setup(*this, cuda::make_draw_task(config_, cameras_, scene, views, nullptr), scene);
  const cuda::VisibilityTask task{setup.task, queries.data(), static_cast<int32_t>(queries.size()),
                                  visibility_out.data()};
  launch(cuda::kLargeThreads, kBlocks, [&] { cuda::emulated_visibility(task, setup.large.view()); });
  fault_ = setup.fault;
}

void EmulatedRenderer::check(Stream) { poll(); }

void EmulatedRenderer::poll() {
  const cuda::Fault fault = cuda::fault_of(std::exchange(fault_, cuda::kNoFault));
  if (fault.kind != cuda::FaultKind::none) fail("{}", cuda::message_of(fault));
}

}  // namespace test
}  // namespace pictura
