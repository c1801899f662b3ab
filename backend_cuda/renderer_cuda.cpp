// The CUDA renderer's host side: checks, uploads, scratch memory and launches. Scenes, views, queries and images lie in
// device memory; nothing here waits for the device but upload().
#include <algorithm>
#include <cmath>
#include <memory>

#include "pictura/backend_cuda/draw_task.h"
#include "pictura/backend_cuda/kernel_library.h"
#include "pictura/backend_cuda/renderer_cuda_launch.h"
#include "pictura/backend_cuda/scratch_plan.h"
#include "pictura/common/cuda/check.cuh"
#include "pictura/common/cuda/device_buffer.cuh"
#include "pictura/common/error.h"
#include "pictura/common/raster_check.h"

namespace pictura {

std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config, std::string* origin_out);
std::string cuda_unavailable();

namespace {

constexpr int kLargeBlocks = 8;
// Room in the pool for the faces and edges of an image: what CARLA's towns ask for on average. Those with more are
// drawn when it is free again. Four edges are for each face, the rest, of which a third is asked for, for those that
// are clipped.
constexpr int kPoolFaces = 200, kPoolEdges = 928;
// ... and of few images, which may all be crowded.
constexpr int kLeastPoolImages = 4 * cuda::kMostEntries / kPoolFaces + 1;
// Views that are drawn at once, at most: enough that the last images of a launch, for which few blocks are left to
// work, do not count.
constexpr std::size_t kViewsAtOnce = 2048;

// Owns what the blocks of the last launch work in.
class ScratchBuffers {
 public:
  ScratchBuffers() = default;
  /// Room for sizes.blocks blocks.
  ScratchBuffers(const cuda::Scratch& sizes, std::size_t bytes_per_block)
      : scratch_(sizes),
        faces_(count(sizes.blocks, sizes.max_faces)),
        edges_(count(sizes.blocks, sizes.max_edges)),
        bytes_(static_cast<std::size_t>(sizes.blocks) * bytes_per_block) {
    scratch_.faces = faces_.data();
    scratch_.edges = edges_.data();
    scratch_.bytes = bytes_.data();
  }
  const cuda::Scratch& view() const { return scratch_; }
  static std::size_t block_bytes(const cuda::Scratch& sizes, std::size_t bytes_per_block) {
    return count(1, sizes.max_faces) * sizeof(ScreenFace) + count(1, sizes.max_edges) * sizeof(PolygonEdge) +
           bytes_per_block;
  }

 private:
  static std::size_t count(int blocks, int each) {
    return static_cast<std::size_t>(blocks) * static_cast<std::size_t>(each);
  }
  cuda::Scratch scratch_;
  DeviceBuffer<ScreenFace> faces_;
  DeviceBuffer<PolygonEdge> edges_;
  DeviceBuffer<unsigned char> bytes_;
};

// The pool of faces that are gathered before they are drawn.
class PoolBuffers {
 public:
  PoolBuffers() = default;
  explicit PoolBuffers(std::size_t images) : PoolBuffers(images, images + kLeastPoolImages) {}
  /// Sets where a task finds the pool and lists images.
  void serve(cuda::DrawTask* task_out) const {
    task_out->pool = {faces_.data(),
                      edges_.data(),
                      images_.data(),
                      makings_.data(),
                      batches_.data(),
                      {entries_.data(), clipped_.data(), cuda::kMostEntries, static_cast<int32_t>(clipped_.size())},
                      static_cast<int32_t>(faces_.size()),
                      static_cast<int32_t>(edges_.size())};
    task_out->postponed_images = lists_.data();
    task_out->overflow_images = lists_.data() + images_.size();
    task_out->drawn_images = lists_.data() + 2 * images_.size();
  }
  // There is room for as many as the faces in the pool make, of each image with a last one that may not be full.
  static constexpr int kBatches = kPoolFaces / cuda::FaceBatch::kEntries + 1;
  static constexpr std::size_t kRoomBytes = kPoolFaces * sizeof(ScreenFace) + kPoolEdges * sizeof(PolygonEdge) +
                                            kBatches * sizeof(cuda::FaceBatch) +
                                            kPoolFaces * sizeof(cuda::ClippedThing);
  static constexpr std::size_t kLeastBytes = kLeastPoolImages * kRoomBytes;
  static constexpr std::size_t kImageBytes = kRoomBytes + sizeof(cuda::GatheredImage) + sizeof(cuda::FaceMaking) +
                                             cuda::kMostEntries * sizeof(uint32_t) +
                                             (2 + cuda::kCrowds) * sizeof(int32_t);

 private:
  // rooms: of kRoomBytes, for the faces of as many images.
  PoolBuffers(std::size_t images, std::size_t rooms)
      : faces_(rooms * kPoolFaces),
        edges_(rooms * kPoolEdges),
        images_(images),
        makings_(images),
        batches_(rooms * kBatches),
        entries_(images * cuda::kMostEntries),
        clipped_(rooms * kPoolFaces),
        lists_((2 + cuda::kCrowds) * images) {}
  DeviceBuffer<ScreenFace> faces_;
  DeviceBuffer<PolygonEdge> edges_;
  DeviceBuffer<cuda::GatheredImage> images_;
  DeviceBuffer<cuda::FaceMaking> makings_;
  DeviceBuffer<cuda::FaceBatch> batches_;
  DeviceBuffer<uint32_t> entries_;
  DeviceBuffer<cuda::ClippedThing> clipped_;
  DeviceBuffer<int32_t> lists_;
};

// Pieces of one kind in device memory.
struct UploadedPieces {
  DeviceBuffer<int32_t> begin, items;
  DeviceBuffer<cuda::Ball> balls;
  cuda::PieceGrid view;

  explicit UploadedPieces(const cuda::PieceGrid& host)
      : begin(host.cells.begin), items(host.cells.items), balls(host.balls), view(host) {
    view.cells.begin = begin.span();
    view.cells.items = items.span();
    view.balls = balls.span();
  }
};

// A map's looks in device memory.
struct UploadedGeometry {
  DeviceBuffer<Strip> strips;
  DeviceBuffer<WallFace> walls;
  DeviceBuffer<LightHead> heads;
  UploadedPieces strip_pieces, wall_pieces;
  cuda::DeviceGeometry view;

  explicit UploadedGeometry(const StaticGeometry& host)
      : strips(host.view().strips),
        walls(host.view().walls),
        heads(host.view().heads),
        strip_pieces(cuda::SortedPieces(host.strips).view()),
        wall_pieces(cuda::SortedPieces(host.walls).view()) {
    view.pieces.strips = strips.span();
    view.pieces.walls = walls.span();
    view.pieces.heads = heads.span();
    view.strips = strip_pieces.view;
    view.walls = wall_pieces.view;
  }
  int pieces() const { return static_cast<int>(strips.size() + walls.size() + heads.size()); }
};

class CudaRenderer final : public Renderer {
 public:
  CudaRenderer(const RendererConfig& config, std::string* origin_out)
      : config_(checked(config)), cameras_(pinhole_cameras(config.rig)), library_(config.rig) {
    int device = 0;
    PICTURA_CUDA(cudaGetDevice(&device));
    PICTURA_CUDA(cudaDeviceGetAttribute(&processors_, cudaDevAttrMultiProcessorCount, device));
    *origin_out = library_.origin();
    grow(0, 1);  // what is too little for any scene is told at once
    const cuda::DrawCounters none;
    counters_ = DeviceBuffer<cuda::DrawCounters>(Span<const cuda::DrawCounters>(&none, 1));
    fault_.host()->view = -1;
  }
  std::string_view name() const override { return "cuda"; }
  MemorySpace space() const override { return MemorySpace::cuda; }
  const RendererConfig& config() const override { return config_; }

  GeometryHandle upload(const StaticGeometry& geometry) override {
    check_geometry(name(), geometry);
    // Frames in flight may read the table of geometries that is replaced here.
    PICTURA_CUDA(cudaDeviceSynchronize());
    geometries_.emplace_back(geometry);
    std::vector<cuda::DeviceGeometry> views;
    for (const UploadedGeometry& each : geometries_) views.push_back(each.view);
    geometry_views_ = DeviceBuffer<cuda::DeviceGeometry>(Span<const cuda::DeviceGeometry>(views));
    most_pieces_ = std::max(most_pieces_, geometries_.back().pieces());
    most_heads_ = std::max(most_heads_, static_cast<int>(geometry.heads.size()));
    return static_cast<GeometryHandle>(geometries_.size()) - 1;
  }

  void render(const SceneBatch& scene, Span<const View> views, const ImageBatch& images_out, Stream stream) override {
    throw_fault();
    check_images(name(), config_.rig, space(), views.size(), images_out, /*draws_f16=*/true);
    cuda::DrawTask task = draw_task(scene, views, &images_out);
    const auto on_stream = static_cast<cudaStream_t>(stream.handle);
    // In as few parts as there is room for, of one size.
    const std::size_t parts = (views.size() + plan_.views - 1) / plan_.views;
    const auto views_at_once = static_cast<int32_t>((views.size() + parts - 1) / std::max(parts, std::size_t{1}));
    for (int32_t left = task.num_views; left > 0; left -= task.num_views, task.first_view += task.num_views) {
      task.num_views = std::min(left, views_at_once);
      PICTURA_CUDA(cuda::launch_draw(library_.kernels(), task, large_.view(), processors_, on_stream));
    }
  }

  void visibility(const SceneBatch& scene, Span<const View> views, Span<const VisibilityQuery> queries,
                  Span<float> visibility_out, Stream stream) override {
    throw_fault();
    PICTURA_CHECK(visibility_out.size() == queries.size(),
                  "renderer cuda: visibility: expected room for {} values, got {}", queries.size(),
                  visibility_out.size());
    cuda::VisibilityTask task{draw_task(scene, views, nullptr)};
    static_assert(sizeof(VisibilityQuery) == 2 * sizeof(int32_t));
    task.queries = &queries.data()->view;
    task.num_queries = static_cast<int32_t>(queries.size());
    task.visibility = visibility_out.data();
    PICTURA_CUDA(
        cuda::launch_visibility(library_.kernels(), task, large_.view(), static_cast<cudaStream_t>(stream.handle)));
  }

 private:
  static const RendererConfig& checked(const RendererConfig& config) {
    validate(config.rig);
    PICTURA_CHECK(config.line_floor_px >= 0 && config.line_floor_px <= kGuardBand_px,
                  "renderer cuda: expected a line floor of 0 to {} pixels, got {}", kGuardBand_px,
                  config.line_floor_px);
    return config;
  }

  cuda::DrawTask draw_task(const SceneBatch& scene, Span<const View> views, const ImageBatch* images) {
    PICTURA_CHECK(scene.space == MemorySpace::cuda, "renderer cuda: scene: expected cuda memory, got host");
    PICTURA_CHECK(scene.world_begin.empty() || (scene.geometry.size() + 1 == scene.world_begin.size() &&
                                                scene.light_begin.size() == scene.world_begin.size()),
                  "renderer cuda: scene: expected a geometry and a range of lights for each of {} worlds",
                  scene.world_begin.size() - 1);
    const std::size_t images_total = views.size() * config_.rig.cameras.size();
    PICTURA_CHECK(images_total < (std::size_t{1} << 31), "renderer cuda: expected fewer than 2^31 images, got {}",
                  images_total);
    grow(scene.agents.size(), views.size());
    cuda::DrawTask task = cuda::make_draw_task(config_, cameras_, scene, views, images);
    task.geometries = geometry_views_.data();
    task.num_geometries = static_cast<int32_t>(geometries_.size());
    task.fault = fault_.device();
    pool_.serve(&task);
    task.counters = counters_.data();
    return task;
  }

  // Room for as many views as the bound allows, and in the last launch for all that a world can hold: after this
  // nothing is cut off. Allocates nothing where an earlier call needed as much.
  void grow(std::size_t agents_total, std::size_t views) {
    most_agents_ = std::max(most_agents_, agents_total);
    cuda::Scratch large = cuda::large_sizes(most_pieces_, most_heads_, most_agents_);
    const cuda::Scratch& had = large_.view();
    const std::size_t most_views = std::max(most_views_, std::min(views, kViewsAtOnce));
    if (most_views == most_views_ && large.max_faces == had.max_faces && large.max_edges == had.max_edges) return;
    const std::size_t large_bytes = cuda::large_block_bytes(large);
    const cuda::ScratchNeeds needs{.large_blocks = kLargeBlocks,
                                   .large_block_bytes = ScratchBuffers::block_bytes(large, large_bytes),
                                   .views = most_views,
                                   .view_bytes = cameras_.size() * PoolBuffers::kImageBytes,
                                   .pool_bytes = PoolBuffers::kLeastBytes};
    plan_ = cuda::plan_scratch(needs, config_.max_scratch_bytes);
    most_views_ = most_views;
    large.blocks = plan_.large_blocks;
    // Released before it is replaced, or both would count.
    large_ = ScratchBuffers();
    pool_ = PoolBuffers();
    large_ = ScratchBuffers(large, large_bytes);
    pool_ = PoolBuffers(plan_.views * cameras_.size());
  }

  void throw_fault() {
    const int32_t view = fault_.host()->view;
    if (view < 0) return;
    const int32_t kind = fault_.host()->kind;
    fault_.host()->view = -1;
    fail("renderer cuda: in an earlier call: {} {}: {}", kind == cuda::kBadQuery ? "visibility query" : "view", view,
         kind == cuda::kBadWorld        ? "no such world"
         : kind == cuda::kBadGeometry   ? "its world has no such geometry"
         : kind == cuda::kTooManyAgents ? "its world has more than 4096 agents"
         : kind == cuda::kBadQuery      ? "no such view or agent"
         : kind == cuda::kNoRoom        ? "shows more than a world can hold"
                                        : "expected a finite pose and hidden agents within the list");
  }

  RendererConfig config_;
  std::vector<PinholeCamera> cameras_;  // in the ego frame
  cuda::KernelLibrary library_;         // outlives the buffers, whose release waits for the device
  std::vector<UploadedGeometry> geometries_;
  DeviceBuffer<cuda::DeviceGeometry> geometry_views_;
  int processors_ = 0, most_pieces_ = 0, most_heads_ = 0;
  std::size_t most_agents_ = 0, most_views_ = 0;
  cuda::ScratchPlan plan_;
  ScratchBuffers large_;
  PoolBuffers pool_;
  DeviceBuffer<cuda::DrawCounters> counters_;
  MappedValue<cuda::Fault> fault_;
};

}  // namespace

std::string cuda_unavailable() {
  int devices = 0;
  const cudaError_t status = cudaGetDeviceCount(&devices);
  if (status != cudaSuccess) {
    cudaGetLastError();  // the error is ours to report, not the next call's
    int driver = 0;
    const bool has_driver = cudaDriverGetVersion(&driver) == cudaSuccess && driver > 0;
    return has_driver ? cudaGetErrorString(status) : "no CUDA device: no NVIDIA driver was found";
  }
  return devices > 0 ? "" : "no CUDA device";
}

std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config, std::string* origin_out) {
  return std::make_unique<CudaRenderer>(config, origin_out);
}

}  // namespace pictura
