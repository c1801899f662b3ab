#include "pictura/common/raster_check.h"

#include <cmath>

#include "pictura/common/error.h"

namespace pictura {

namespace {

bool finite(Vec2 v) { return std::isfinite(v.x) && std::isfinite(v.y); }
bool finite(Vec3 v) { return finite(v.xy()) && std::isfinite(v.z); }

std::string_view name_of(MemorySpace space) { return space == MemorySpace::host ? "host" : "cuda"; }

// A direction given by its cosine and sine; headings are computed in float, so a little drift is no fault.
bool is_direction(float cosine, float sine) { return std::abs(cosine * cosine + sine * sine - 1.0f) < 1e-2f; }

void check_ranges(std::string_view renderer, std::string_view name, Span<const int32_t> begin, std::size_t size) {
  PICTURA_CHECK(!begin.empty() && begin[0] == 0 && begin[begin.size() - 1] == static_cast<int64_t>(size),
                "renderer {}: scene: {}: expected to start with 0 and to end with {}", renderer, name, size);
  for (std::size_t i = 1; i < begin.size(); ++i) {
    PICTURA_CHECK(begin[i - 1] <= begin[i], "renderer {}: scene: {}[{}]: expected at least {}, got {}", renderer, name,
                  i, begin[i - 1], begin[i]);
  }
}

}  // namespace

void check_images(std::string_view renderer, const Rig& rig, MemorySpace space, std::size_t num_views,
                  const ImageBatch& images, bool draws_f16) {
  PICTURA_CHECK(images.space == space, "renderer {}: images: expected {} memory, got {}", renderer, name_of(space),
                name_of(images.space));
  PICTURA_CHECK(draws_f16 || images.format != PixelFormat::f16,
                "renderer {}: images: expected the format u8 or f32, got f16", renderer);
  PICTURA_CHECK(images.num_views >= 0 && static_cast<std::size_t>(images.num_views) == num_views,
                "renderer {}: images: expected room for {} views, got {}", renderer, num_views, images.num_views);
  PICTURA_CHECK(images.cameras.size() == rig.cameras.size(), "renderer {}: images: expected {} cameras, got {}",
                renderer, rig.cameras.size(), images.cameras.size());
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraImages& camera = images.cameras[i];
    const Camera& wanted = rig.cameras[i];
    PICTURA_CHECK(camera.width_px == wanted.width_px && camera.height_px == wanted.height_px,
                  "renderer {}: images: camera {}: expected {}x{} pixels, got {}x{}", renderer, i, wanted.width_px,
                  wanted.height_px, camera.width_px, camera.height_px);
    PICTURA_CHECK(num_views == 0 || camera.data != nullptr, "renderer {}: images: camera {}: no memory for colour",
                  renderer, i);
    const int64_t image_values = int64_t{3} * camera.width_px * camera.height_px;
    PICTURA_CHECK(num_views < 2 || camera.view_stride >= image_values,
                  "renderer {}: images: camera {}: expected a view stride of at least {} values, got {}", renderer, i,
                  image_values, camera.view_stride);
  }
}

void check_scene(std::string_view renderer, const SceneBatch& scene, Span<const StaticGeometryView> geometries) {
  PICTURA_CHECK(scene.space == MemorySpace::host, "renderer {}: scene: expected host memory, got {}", renderer,
                name_of(scene.space));
  if (scene.world_begin.empty()) {
    PICTURA_CHECK(scene.agents.empty() && scene.geometry.empty(), "renderer {}: scene: no worlds, but agents or maps",
                  renderer);
    return;
  }
  const std::size_t worlds = scene.world_begin.size() - 1;
  check_ranges(renderer, "world_begin", scene.world_begin, scene.agents.size());
  PICTURA_CHECK(scene.geometry.size() == worlds,
                "renderer {}: scene: expected a geometry for each of {} worlds, got {}", renderer, worlds,
                scene.geometry.size());
  PICTURA_CHECK(scene.light_begin.size() == worlds + 1, "renderer {}: scene: light_begin: expected {} elements, got {}",
                renderer, worlds + 1, scene.light_begin.size());
  check_ranges(renderer, "light_begin", scene.light_begin, scene.light_states.size());
  for (std::size_t world = 0; world < worlds; ++world) {
    const GeometryHandle handle = scene.geometry[world];
    PICTURA_CHECK(handle >= 0 && static_cast<std::size_t>(handle) < geometries.size(),
                  "renderer {}: scene: world {}: expected a geometry handle below {}, got {}", renderer, world,
                  geometries.size(), handle);
    const int32_t lights = scene.light_begin[world + 1] - scene.light_begin[world];
    const int32_t signals = geometries[static_cast<std::size_t>(handle)].num_signals;
    PICTURA_CHECK(lights >= signals || lights == 0,
                  "renderer {}: scene: world {}: expected a light state for each of {} signals, or none, got {}",
                  renderer, world, signals, lights);
  }
  for (std::size_t i = 0; i < scene.agents.size(); ++i) {
    const AgentBox& box = scene.agents[i];
    if (!box.drawn) continue;
    PICTURA_CHECK(finite(box.center_m) && is_direction(box.cos_heading, box.sin_heading),
                  "renderer {}: scene: agent {}: expected a finite pose, got ({}, {}, {}) m and heading ({}, {})",
                  renderer, i, box.center_m.x, box.center_m.y, box.center_m.z, box.cos_heading, box.sin_heading);
    PICTURA_CHECK(std::isfinite(box.length_m) && std::isfinite(box.width_m) && std::isfinite(box.height_m) &&
                      box.length_m >= 0 && box.width_m >= 0 && box.height_m >= 0,
                  "renderer {}: scene: agent {}: expected a size of 0 m or more, got {} x {} x {}", renderer, i,
                  box.length_m, box.width_m, box.height_m);
    PICTURA_CHECK(static_cast<int>(box.agent_class) < kNumAgentClasses,
                  "renderer {}: scene: agent {}: expected a class below {}, got {}", renderer, i, kNumAgentClasses,
                  static_cast<int>(box.agent_class));
  }
}

void check_views(std::string_view renderer, const SceneBatch& scene, Span<const View> views) {
  const std::size_t worlds = scene.world_begin.empty() ? 0 : scene.world_begin.size() - 1;
  for (std::size_t i = 0; i < views.size(); ++i) {
    const View& view = views[i];
    PICTURA_CHECK(view.world >= 0 && static_cast<std::size_t>(view.world) < worlds,
                  "renderer {}: view {}: expected a world below {}, got {}", renderer, i, worlds, view.world);
    PICTURA_CHECK(view.ego_agent >= -1 && view.ego_agent < static_cast<int64_t>(scene.agents.size()),
                  "renderer {}: view {}: expected an ego below {} or -1, got {}", renderer, i, scene.agents.size(),
                  view.ego_agent);
    PICTURA_CHECK(view.hidden_begin >= 0 && view.hidden_begin <= view.hidden_end &&
                      view.hidden_end <= static_cast<int64_t>(scene.hidden_agents.size()),
                  "renderer {}: view {}: expected hidden agents within a list of {}, got [{}, {})", renderer, i,
                  scene.hidden_agents.size(), view.hidden_begin, view.hidden_end);
    PICTURA_CHECK(finite(view.origin_m) && is_direction(view.cos_heading, view.sin_heading),
                  "renderer {}: view {}: expected a finite pose, got ({}, {}, {}) m and heading ({}, {})", renderer, i,
                  view.origin_m.x, view.origin_m.y, view.origin_m.z, view.cos_heading, view.sin_heading);
    PICTURA_CHECK(std::isfinite(view.body_length_m) && view.body_length_m >= 0,
                  "renderer {}: view {}: expected a body length of 0 m or more, got {}", renderer, i,
                  view.body_length_m);
  }
}

void check_queries(std::string_view renderer, const SceneBatch& scene, std::size_t num_views,
                   Span<const VisibilityQuery> queries, std::size_t num_answers) {
  PICTURA_CHECK(num_answers == queries.size(), "renderer {}: visibility: expected room for {} values, got {}", renderer,
                queries.size(), num_answers);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const VisibilityQuery& query = queries[i];
    PICTURA_CHECK(query.view >= 0 && static_cast<std::size_t>(query.view) < num_views && query.agent >= 0 &&
                      static_cast<std::size_t>(query.agent) < scene.agents.size(),
                  "renderer {}: visibility query {}: expected a view below {} and an agent below {}, got {} and {}",
                  renderer, i, num_views, scene.agents.size(), query.view, query.agent);
  }
}

void check_geometry(std::string_view renderer, const StaticGeometry& geometry) {
  for (std::size_t i = 0; i < geometry.strips.size(); ++i) {
    const Strip& strip = geometry.strips[i];
    PICTURA_CHECK(finite(strip.a_m) && finite(strip.b_m) && finite(strip.side_a) && finite(strip.side_b) &&
                      std::isfinite(strip.width_m) && strip.width_m >= 0,
                  "renderer {}: geometry: strip {}: expected finite ends and a width of 0 m or more", renderer, i);
  }
  for (std::size_t i = 0; i < geometry.walls.size(); ++i) {
    const WallFace& wall = geometry.walls[i];
    PICTURA_CHECK(finite(wall.a_m) && finite(wall.b_m) && std::isfinite(wall.height_m) && wall.height_m >= 0,
                  "renderer {}: geometry: wall {}: expected finite ends and a height of 0 m or more", renderer, i);
  }
  for (std::size_t i = 0; i < geometry.heads.size(); ++i) {
    const LightHead& head = geometry.heads[i];
    PICTURA_CHECK(finite(head.position_m) && is_direction(head.facing.x, head.facing.y),
                  "renderer {}: geometry: light head {}: expected a finite position and a unit facing", renderer, i);
    PICTURA_CHECK(head.signal >= 0 && head.signal < geometry.num_signals,
                  "renderer {}: geometry: light head {}: expected a signal below {}, got {}", renderer, i,
                  geometry.num_signals, head.signal);
  }
  PICTURA_CHECK(geometry.strips.empty() || geometry.strip_grid.view().begin.size() > 1,
                "renderer {}: geometry: grids are not built", renderer);
  PICTURA_CHECK(geometry.walls.empty() || geometry.wall_grid.view().begin.size() > 1,
                "renderer {}: geometry: grids are not built", renderer);
}

std::vector<PinholeCamera> pinhole_cameras(const Rig& rig) {
  std::vector<PinholeCamera> cameras;
  for (const Camera& camera : rig.cameras) {
    const CameraAxes axes = camera_axes(camera);
    cameras.push_back({camera.position_m, axes.right, axes.down, axes.forward, camera.focal_x_px, camera.focal_y_px,
                       camera.center_x_px, camera.center_y_px, camera.width_px, camera.height_px});
  }
  return cameras;
}

}  // namespace pictura
