#include "pictura/backend_cuda/renderer/draw_task.h"

#include <algorithm>

#include <fmt/format.h>

#include "pictura/common/raster/clip.h"

namespace pictura::cuda {

SortedPieces::SortedPieces(const std::vector<Strip>& strips) {
  std::vector<Ball> balls;
  for (const Strip& strip : strips) balls.push_back({strip_middle(strip), strip_radius_m(strip)});
  sort(std::move(balls));
}

SortedPieces::SortedPieces(const std::vector<WallFace>& walls) {
  std::vector<Ball> balls;
  for (const WallFace& wall : walls) balls.push_back({wall_middle(wall), wall_radius_m(wall)});
  sort(std::move(balls));
}

void SortedPieces::sort(std::vector<Ball> balls) {
  constexpr float kCell_m = 16.0f;
  // Margin that exceeds the rounding errors of the ranges that queries search.
  constexpr float kLeeway_m = 0.1f;
  std::vector<Aabb2> middles;
  for (const Ball& ball : balls) {
    middles.push_back({ball.center_m.xy(), ball.center_m.xy()});
    largest_radius_m_ = std::max(largest_radius_m_, ball.radius_m);
  }
  largest_radius_m_ += kLeeway_m;
  grid_ = Grid(middles, kCell_m);
  for (const int32_t item : grid_.view().items) balls_.push_back(balls[item]);
}

DrawTask make_draw_task(const RendererConfig& config, const std::vector<PinholeCamera>& cameras,
                        const SceneBatch& scene, const ViewBatch& views, const ImageBatch* images) {
  DrawTask task;
  task.scene = scene;
  task.views = views.views.data();
  task.view_count = views.num_views;
  task.num_views = task.max_views = static_cast<int32_t>(views.size());
  task.num_cameras = static_cast<int32_t>(cameras.size());
  task.line_floor_px = config.line_floor_px;
  task.debug_palette = config.debug_palette;
  task.randomization = config.randomization;
  for (std::size_t i = 0; i < cameras.size(); ++i) {
    CameraSlot& slot = task.cameras[i];
    slot.camera = cameras[i];
    slot.frustum = make_frustum(cameras[i]);
    if (!images) continue;
    const CameraImages& out = images->cameras[i];
    slot.color = out.data;
    slot.view_stride = out.view_stride;
    slot.planes = {out.depth_m, out.class_id, out.instance_id};
    task.wants_planes = task.wants_planes || slot.planes.are_wanted();
  }
  if (images) task.format = images->format, task.order = images->order, task.patch_px = images->patch_px;
  return task;
}

std::string message_of(const Fault& fault) {
  auto what = [&]() -> std::string {
    switch (fault.kind) {
      case FaultKind::bad_world: return "no such world";
      case FaultKind::bad_geometry: return "its world has no such geometry";
      case FaultKind::bad_pose: return "expected a finite pose and hidden agents within the list";
      case FaultKind::too_few_lights: return "its world has fewer light states than its map signals";
      case FaultKind::too_many_agents: return fmt::format("its world has more than {} agents", kMaxBoxesPerWorld);
      case FaultKind::bad_query: return "no such view, or no such agent in its world";
      case FaultKind::bad_view_count: return "expected 0 or more, and no more than the call has views";
      case FaultKind::capacity_exceeded: return "shows more than a world can hold";
      case FaultKind::none: break;
    }
    return "";
  };
  const char* where = fault.kind == FaultKind::bad_query        ? "visibility query"
                      : fault.kind == FaultKind::bad_view_count ? "number of views"
                                                                : "view";
  return fmt::format("{} {}: {}", where, fault.index, what());
}

Scratch overflow_sizes(int pieces, int heads, std::size_t agents) {
  // A camera sees up to three faces of an agent and one of every other primitive; faces of four corners have at most
  // nine edges after clipping.
  Scratch sizes;
  sizes.max_faces = std::max(1, pieces + 3 * static_cast<int>(std::min<std::size_t>(agents, kMaxBoxesPerWorld)));
  sizes.max_edges = (4 + 9) * sizes.max_faces + kMaxPolygonCorners * heads;
  return sizes;
}

}  // namespace pictura::cuda
