// Host side of the CUDA renderer: checks, maps, scratch memory and launches. Scenes, views, queries and images lie in
// device memory. Drawing calls neither allocate nor wait once their sizes have been reserved.
#include <algorithm>
#include <cmath>
#include <memory>

#include "pictura/backend_cuda/renderer/draw_task.h"
#include "pictura/backend_cuda/renderer/geometry_table.h"
#include "pictura/backend_cuda/renderer/kernel_library.h"
#include "pictura/backend_cuda/renderer/launch.h"
#include "pictura/backend_cuda/renderer/scratch_buffers.h"
#include "pictura/backend_cuda/renderer/scratch_plan.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/cuda/device_guard.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"

namespace pictura {

std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config, std::string* origin_out);
std::string cuda_unavailable();

namespace {

// Number of blocks of the last launch.
constexpr int kLargeBlocks = 8;
// Maximum number of views that are drawn together. It is so large that the end of a launch, when only few blocks still
// work, takes a negligible share of the time.
constexpr std::size_t kViewsAtOnce = 2048;

// Scratch memory, and the sizes of the largest calls for which it suffices.
struct ScratchMemory {
  std::size_t agents = 0, views = 0;
  int pieces = 0, heads = 0;
  cuda::ScratchPlan plan;
  cuda::OverflowBuffers<DeviceBuffer> large;
  cuda::PoolBuffers<DeviceBuffer> pool;
};

class CudaRenderer final : public Renderer {
 public:
  /// Constructs the renderer for the current device.
  CudaRenderer(const RendererConfig& config, std::string* origin_out)
      : config_(check_config("cuda", config)), cameras_(pinhole_cameras(config.rig)), library_(config) {
    PICTURA_CUDA(cudaDeviceGetAttribute(&processors_, cudaDevAttrMultiProcessorCount, config.device.index));
    *origin_out = library_.origin();
    ensure_capacity(0, 1);  // throws if max_scratch_bytes is too low for any scene
    *fault_.host() = cuda::kNoFault;
    counters_.fill(0);
    PICTURA_CUDA(cudaDeviceSynchronize());  // the first call may be on any stream
  }
  std::string_view name() const override { return "cuda"; }
  Device device() const override { return config_.device; }
  const RendererConfig& config() const override { return config_; }

  void upload(GeometryHandle handle, const StaticGeometry& geometry, Stream stream) override {
    const DeviceGuard guard(device());
    check_handle(name(), handle);
    check_geometry(name(), geometry);
    geometries_.upload(handle, geometry, static_cast<cudaStream_t>(stream.handle));
    // The next call allocates more; previously captured graphs have too little memory for this map.
    if (geometries_.max_pieces() > scratch_.pieces || geometries_.max_heads() > scratch_.heads) ++scratch_generation_;
  }
  void release(GeometryHandle handle, Stream stream) override {
    const DeviceGuard guard(device());
    check_handle(name(), handle);
    geometries_.release(handle, static_cast<cudaStream_t>(stream.handle));
  }

  void reserve(int max_views, int max_boxes) override {
    const DeviceGuard guard(device());
    check_reserved(name(), max_views, max_boxes);
    ensure_capacity(static_cast<std::size_t>(max_boxes), static_cast<std::size_t>(max_views));
  }
  uint64_t generation() const override { return scratch_generation_ + geometries_.generation(); }

  void render(const SceneBatch& scene, const ViewBatch& views, const ImageBatch& images_out, Stream stream) override {
    const DeviceGuard guard(device());
    check_call(scene);
    check_images(*this, views.size(), images_out);
    cuda::DrawTask task = draw_task(scene, views, &images_out);
    const auto on_stream = static_cast<cudaStream_t>(stream.handle);
    clear_counters(on_stream);
    if (views.size() == 0) return;
    // Draws in as few parts as the scratch memory allows, of equal size.
    const std::size_t max_views = scratch_.plan.views, parts = (views.size() + max_views - 1) / max_views;
    const auto views_at_once = static_cast<int32_t>((views.size() + parts - 1) / parts);
    for (int32_t left = task.num_views; left > 0; left -= task.num_views, task.first_view += task.num_views) {
      task.num_views = std::min(left, views_at_once);
      counters_are_clear_ = false;  // remains false if a launch fails
      PICTURA_CUDA(cuda::launch_draw(library_.kernels(), task, scratch_.large.view(), processors_, on_stream));
      counters_are_clear_ = true;
    }
  }

  void poll() override { throw_fault(); }
  void check(Stream stream) override {
    const DeviceGuard guard(device());
    PICTURA_CUDA(cudaStreamSynchronize(static_cast<cudaStream_t>(stream.handle)));
    poll();
  }

  void visibility(const SceneBatch& scene, const ViewBatch& views, Span<const VisibilityQuery> queries,
                  Span<float> visibility_out, Stream stream) override {
    const DeviceGuard guard(device());
    check_call(scene);
    check_answers(name(), queries.size(), visibility_out.size());
    const cuda::VisibilityTask task{draw_task(scene, views, nullptr), queries.data(),
                                    static_cast<int32_t>(queries.size()), visibility_out.data()};
    PICTURA_CUDA(cuda::launch_visibility(library_.kernels(), task, scratch_.large.view(),
                                         static_cast<cudaStream_t>(stream.handle)));
  }

 private:
  // Checks everything that the host can see of a call.
  void check_call(const SceneBatch& scene) {
    throw_fault();
    check_device(name(), "scene", device(), scene.device);
    PICTURA_CHECK(scene.world_begin.empty() || (scene.geometry.size() + 1 == scene.world_begin.size() &&
                                                scene.light_begin.size() == scene.world_begin.size()),
                  "renderer cuda: scene: expected a geometry and a range of lights for each of {} worlds",
                  scene.world_begin.size() - 1);
  }

  cuda::DrawTask draw_task(const SceneBatch& scene, const ViewBatch& views, const ImageBatch* images) {
    const std::size_t images_total = views.size() * config_.rig.cameras.size();
    PICTURA_CHECK(images_total < (std::size_t{1} << 31), "renderer cuda: expected fewer than 2^31 images, got {}",
                  images_total);
    ensure_capacity(scene.agents.size(), views.size());
    cuda::DrawTask task = cuda::make_draw_task(config_, cameras_, scene, views, images);
    task.geometries = geometries_.entries();
    task.num_geometries = geometries_.num_entries();
    task.fault = fault_.device();
    scratch_.pool.serve(&task);
    task.counters = counters_.data();
    return task;
  }

  // Counters are 0 before each call. The last launch resets them, unless an earlier launch failed.
  void clear_counters(cudaStream_t stream) {
    if (counters_are_clear_) return;
    PICTURA_CUDA(cudaMemsetAsync(counters_.data(), 0, sizeof(cuda::DrawCounters), stream));
    counters_are_clear_ = true;
  }

  // Allocates memory for as many views as max_scratch_bytes allows, and in the last launch for all primitives of a
  // world, so that no primitive is left out. Does nothing if an earlier call needed as much. If it throws for lack of
  // memory, the next call allocates again.
  void ensure_capacity(std::size_t agents, std::size_t views) {
    agents = std::max(scratch_.agents, std::min(agents, static_cast<std::size_t>(kMaxBoxesPerWorld)));
    views = std::max({scratch_.views, std::size_t{1}, std::min(views, kViewsAtOnce)});
    const int pieces = std::max(scratch_.pieces, geometries_.max_pieces());
    const int heads = std::max(scratch_.heads, geometries_.max_heads());
    if (agents == scratch_.agents && views == scratch_.views && pieces == scratch_.pieces && heads == scratch_.heads)
      return;
    cuda::Scratch large = cuda::overflow_sizes(pieces, heads, agents);
    const std::size_t large_bytes = cuda::large_block_bytes(large);
    const cuda::ScratchPlan plan =
        cuda::plan_scratch({.large_blocks = kLargeBlocks,
                            .large_block_bytes = cuda::OverflowBuffers<DeviceBuffer>::block_bytes(large, large_bytes),
                            .views = views,
                            .view_bytes = cameras_.size() * cuda::kPoolImageBytes,
                            .pool_bytes = cuda::kMinPoolBytes},
                           config_.max_scratch_bytes);
    large.blocks = plan.large_blocks;
    // The old memory is freed first, so that old and new memory are never allocated at the same time.
    scratch_ = ScratchMemory();
    ++scratch_generation_;
    ScratchMemory larger{agents, views, pieces, heads, plan, {}, {}};
    larger.large = cuda::OverflowBuffers<DeviceBuffer>(large, large_bytes);
    larger.pool = cuda::PoolBuffers<DeviceBuffer>(cuda::pool_sizes(plan.views * cameras_.size()));
    scratch_ = std::move(larger);
  }

  void throw_fault() {
    const cuda::Fault fault = cuda::fault_of(*fault_.host());
    if (fault.kind == cuda::FaultKind::none) return;
    *fault_.host() = cuda::kNoFault;
    fail("renderer cuda: in an earlier call: {}", cuda::message_of(fault));
  }

  RendererConfig config_;
  std::vector<PinholeCamera> cameras_;  // in the ego frame
  cuda::KernelLibrary library_;         // outlives the buffers, whose release waits for the device
  cuda::GeometryTable geometries_;
  int processors_ = 0;
  ScratchMemory scratch_;
  uint64_t scratch_generation_ = 0;
  DeviceBuffer<cuda::DrawCounters> counters_{1};
  bool counters_are_clear_ = true;
  MappedValue<cuda::FaultWord> fault_;
};

}  // namespace

std::string cuda_unavailable() {
  int devices = 0;
  const cudaError_t status = cudaGetDeviceCount(&devices);
  if (status != cudaSuccess) {
    cudaGetLastError();  // clears the error, which is reported here
    int driver = 0;
    const bool has_driver = cudaDriverGetVersion(&driver) == cudaSuccess && driver > 0;
    return has_driver ? cudaGetErrorString(status) : "no CUDA device: no NVIDIA driver was found";
  }
  return devices > 0 ? "" : "no CUDA device";
}

std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config, std::string* origin_out) {
  int devices = 0;
  PICTURA_CUDA(cudaGetDeviceCount(&devices));
  PICTURA_CHECK(!config.device.is_host() && config.device.index >= 0 && config.device.index < devices,
                "renderer cuda: device: expected cuda:0 to cuda:{}, got {}", devices - 1, name_of(config.device));
  const DeviceGuard guard(config.device);
  return std::make_unique<CudaRenderer>(config, origin_out);
}

}  // namespace pictura
