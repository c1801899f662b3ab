// The CUDA renderer's host side: checks, uploads, scratch memory and launches. Scenes, views, queries and images lie in
// device memory; nothing here waits for the device but upload().
#include <algorithm>
#include <cmath>
#include <memory>

#include "pictura/backend_cuda/renderer_cuda_kernel.h"
#include "pictura/common/cuda/check.cuh"
#include "pictura/common/cuda/device_buffer.cuh"
#include "pictura/common/error.h"
#include "pictura/common/raster_check.h"

namespace pictura {

std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config);
std::string cuda_unavailable();

namespace {

constexpr int kMaxWorldAgents = 4096;
// Most images fit into this; the rest are drawn with room for a whole map.
constexpr int kSmallItems = 384, kSmallFaces = 640, kSmallEdges = 3072;
constexpr int kSmallBlocksPerProcessor = 4, kLargeBlocks = 8;

class ScratchBuffers {
 public:
  ScratchBuffers() = default;
  ScratchBuffers(int blocks, int items, int faces, int edges)
      : blocks_(blocks),
        max_items_(items),
        max_faces_(faces),
        max_edges_(edges),
        items_(count(blocks, items)),
        faces_(count(blocks, faces)),
        edges_(count(blocks, edges)),
        order_(count(blocks, items)),
        foreground_(count(blocks, items)),
        waiting_(count(blocks, items)) {}
  int max_items() const { return max_items_; }
  cuda::Scratch view() const {
    return {items_.data(),   faces_.data(), edges_.data(), order_.data(), foreground_.data(),
            waiting_.data(), blocks_,       max_items_,    max_faces_,    max_edges_};
  }

 private:
  static std::size_t count(int blocks, int each) {
    return static_cast<std::size_t>(blocks) * static_cast<std::size_t>(each);
  }
  int blocks_ = 0, max_items_ = 0, max_faces_ = 0, max_edges_ = 0;
  DeviceBuffer<RasterItem> items_;
  DeviceBuffer<ScreenFace> faces_;
  DeviceBuffer<PolygonEdge> edges_;
  DeviceBuffer<int32_t> order_, foreground_;
  DeviceBuffer<int64_t> waiting_;
};

// A map's looks in device memory.
struct DeviceGeometry {
  DeviceBuffer<Strip> strips;
  DeviceBuffer<WallFace> walls;
  DeviceBuffer<LightHead> heads;
  DeviceBuffer<int32_t> strip_begin, strip_items, wall_begin, wall_items;
  RasterGeometry view;

  explicit DeviceGeometry(const StaticGeometry& host)
      : strips(host.view().strips), walls(host.view().walls), heads(host.view().heads), view(raster_geometry(host)) {
    auto grid = [](const GridView& grid_on_host, DeviceBuffer<int32_t>* begin, DeviceBuffer<int32_t>* items) {
      *begin = DeviceBuffer<int32_t>(grid_on_host.begin);
      *items = DeviceBuffer<int32_t>(grid_on_host.items);
      GridView on_device = grid_on_host;
      on_device.begin = begin->span();
      on_device.items = items->span();
      return on_device;
    };
    view.pieces.strips = strips.span();
    view.pieces.walls = walls.span();
    view.pieces.heads = heads.span();
    view.pieces.strip_grid = grid(host.strip_grid.view(), &strip_begin, &strip_items);
    view.pieces.wall_grid = grid(host.wall_grid.view(), &wall_begin, &wall_items);
  }
  int pieces() const { return static_cast<int>(strips.size() + walls.size() + heads.size()); }
};

class CudaRenderer final : public Renderer {
 public:
  explicit CudaRenderer(const RendererConfig& config) : config_(config) {
    validate(config_.rig);
    PICTURA_CHECK(config_.line_floor_px >= 0 && config_.line_floor_px <= kGuardBand_px,
                  "renderer cuda: expected a line floor of 0 to {} pixels, got {}", kGuardBand_px,
                  config_.line_floor_px);
    int device = 0, processors = 0;
    PICTURA_CUDA(cudaGetDevice(&device));
    PICTURA_CUDA(cudaDeviceGetAttribute(&processors, cudaDevAttrMultiProcessorCount, device));
    small_ = ScratchBuffers(kSmallBlocksPerProcessor * processors, kSmallItems, kSmallFaces, kSmallEdges);
    overflow_count_ = DeviceBuffer<int32_t>(1);
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
    std::vector<RasterGeometry> views;
    for (const DeviceGeometry& each : geometries_) views.push_back(each.view);
    geometry_views_ = DeviceBuffer<RasterGeometry>(Span<const RasterGeometry>(views));
    most_pieces_ = std::max(most_pieces_, geometries_.back().pieces());
    most_heads_ = std::max(most_heads_, static_cast<int>(geometry.heads.size()));
    return static_cast<GeometryHandle>(geometries_.size()) - 1;
  }

  void render(const SceneBatch& scene, Span<const View> views, const ImageBatch& images_out, Stream stream) override {
    throw_fault();
    check_images(name(), config_.rig, space(), views.size(), images_out);
    const cuda::DrawTask task = draw_task(scene, views, &images_out);
    cuda::launch_draw(task, small_.view(), large_.view(), static_cast<cudaStream_t>(stream.handle));
    PICTURA_CUDA(cudaGetLastError());
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
    cuda::launch_visibility(task, large_.view(), static_cast<cudaStream_t>(stream.handle));
    PICTURA_CUDA(cudaGetLastError());
  }

 private:
  cuda::DrawTask draw_task(const SceneBatch& scene, Span<const View> views, const ImageBatch* images) {
    PICTURA_CHECK(scene.space == MemorySpace::cuda, "renderer cuda: scene: expected cuda memory, got host");
    PICTURA_CHECK(scene.world_begin.empty() || (scene.geometry.size() + 1 == scene.world_begin.size() &&
                                                scene.light_begin.size() == scene.world_begin.size()),
                  "renderer cuda: scene: expected a geometry and a range of lights for each of {} worlds",
                  scene.world_begin.size() - 1);
    const std::size_t images_total = views.size() * config_.rig.cameras.size();
    PICTURA_CHECK(images_total < (std::size_t{1} << 31), "renderer cuda: expected fewer than 2^31 images, got {}",
                  images_total);
    grow(scene, images_total);
    cuda::DrawTask task;
    task.scene = scene;
    task.views = views.data();
    task.num_views = static_cast<int32_t>(views.size());
    task.num_cameras = static_cast<int32_t>(config_.rig.cameras.size());
    task.geometries = geometry_views_.data();
    task.num_geometries = static_cast<int32_t>(geometries_.size());
    task.max_world_agents = kMaxWorldAgents;
    task.line_floor_px = config_.line_floor_px;
    task.debug_palette = config_.debug_palette;
    task.fault = fault_.device();
    task.overflow_count = overflow_count_.data();
    task.overflow_images = overflow_images_.data();
    const std::vector<PinholeCamera> cameras = pinhole_cameras(config_.rig);
    for (std::size_t i = 0; i < cameras.size(); ++i) {
      task.cameras[i].camera = cameras[i];
      if (!images) continue;
      const CameraImages& out = images->cameras[i];
      task.cameras[i] = {cameras[i], out.data, out.view_stride, out.depth_m, out.class_id, out.instance_id};
    }
    task.as_float = images && images->format == PixelFormat::f32;
    return task;
  }

  // Room for every image, and in the second pass for all that a world can hold: after this nothing is cut off.
  void grow(const SceneBatch& scene, std::size_t images) {
    if (overflow_images_.size() < images) overflow_images_ = DeviceBuffer<int32_t>(images);
    const int agents = static_cast<int>(std::min<std::size_t>(scene.agents.size(), kMaxWorldAgents));
    const int items = std::max(1, most_pieces_ + agents);
    if (items <= large_.max_items()) return;
    // Agents show up to three faces, everything else one; faces of four corners have at most nine edges when clipped.
    const int faces = most_pieces_ + kMaxItemFaces * agents;
    large_ = ScratchBuffers();
    large_ = ScratchBuffers(kLargeBlocks, items, faces, 9 * faces + kMaxPolygonCorners * most_heads_);
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
  std::vector<DeviceGeometry> geometries_;
  DeviceBuffer<RasterGeometry> geometry_views_;
  int most_pieces_ = 0, most_heads_ = 0;
  ScratchBuffers small_, large_;
  DeviceBuffer<int32_t> overflow_count_, overflow_images_;
  MappedValue<cuda::Fault> fault_;
};

}  // namespace

std::string cuda_unavailable() {
  int devices = 0;
  const cudaError_t status = cudaGetDeviceCount(&devices);
  if (status != cudaSuccess) {
    cudaGetLastError();  // the error is ours to report, not the next call's
    return cudaGetErrorString(status);
  }
  return devices > 0 ? "" : "no CUDA device";
}

std::unique_ptr<Renderer> make_cuda_renderer(const RendererConfig& config) {
  return std::make_unique<CudaRenderer>(config);
}

}  // namespace pictura
