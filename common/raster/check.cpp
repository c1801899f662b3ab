#include "pictura/common/raster/check.h"

#include "pictura/common/array.h"
#include "pictura/common/error.h"
#include "pictura/common/rng.h"

namespace pictura {

namespace {

bool is_color(Rgb color) {
  auto is_channel = [](float value) { return value >= 0.0f && value <= 1.0f; };
  return is_channel(color.r) && is_channel(color.g) && is_channel(color.b);
}

void check_color(std::string_view renderer, std::string_view piece, std::size_t i, Rgb color) {
  PICTURA_CHECK(is_color(color), "renderer {}: geometry: {} {}: expected a colour of 0 to 1, got ({}, {}, {})",
                renderer, piece, i, color.r, color.g, color.b);
}

// Checks that a grid contains all pieces, because a geometry may get more pieces after its grid was built.
void check_grid(std::string_view renderer, std::string_view pieces, std::size_t count, const Grid& grid) {
  PICTURA_CHECK(grid.num_boxes() == count,
                "renderer {}: geometry: expected grids built from all {} {}, got a grid of {}: call build_grids() last",
                renderer, count, pieces, grid.num_boxes());
}

void check_ranges(std::string_view renderer, std::string_view name, Span<const int32_t> begin, std::size_t size) {
  PICTURA_CHECK(!begin.empty() && begin[0] == 0 && begin[begin.size() - 1] == static_cast<int64_t>(size),
                "renderer {}: scene: {}: expected to start with 0 and to end with {}", renderer, name, size);
  for (std::size_t i = 1; i < begin.size(); ++i) {
    PICTURA_CHECK(begin[i - 1] <= begin[i], "renderer {}: scene: {}[{}]: expected at least {}, got {}", renderer, name,
                  i, begin[i - 1], begin[i]);
  }
}

void check_randomization(std::string_view renderer, const CameraRandomization& ranges) {
  constexpr CameraRandomization kMax = kMaxCameraRandomization;
  auto check_range = [renderer](const char* name, double range, double highest) {
    PICTURA_CHECK(range >= 0 && range <= highest, "renderer {}: randomization: {}: expected 0 to {}, got {}", renderer,
                  name, highest, range);
  };
  check_range("rotation_deg", ranges.rotation_deg, kMax.rotation_deg);
  check_range("shift_m", ranges.shift_m, kMax.shift_m);
  check_range("focal_share", ranges.focal_share, kMax.focal_share);
  check_range("brightness_share", ranges.brightness_share, kMax.brightness_share);
  check_range("noise_share", ranges.noise_share, kMax.noise_share);
  check_range("dead_probability", ranges.dead_probability, kMax.dead_probability);
  check_range("dropped_probability", ranges.dropped_probability, kMax.dropped_probability);
}

}  // namespace

void check_device(std::string_view renderer, std::string_view what, Device expected, Device device) {
  PICTURA_CHECK(device == expected, "renderer {}: {}: expected {}, got {}", renderer, what, name_of(expected),
                name_of(device));
}

void check_images(const Renderer& renderer, std::size_t num_views, const ImageBatch& images) {
  const std::string_view name = renderer.name();
  const Rig& rig = renderer.config().rig;
  const bool draws_all = renderer.draws_all_formats();
  check_device(name, "images", renderer.device(), images.device);
  PICTURA_CHECK(draws_all || images.format == PixelFormat::u8 || images.format == PixelFormat::f32,
                "renderer {}: images: expected the format u8 or f32, got {}", name,
                images.format == PixelFormat::f16 ? "f16" : "bf16");
  PICTURA_CHECK(images.order == ChannelOrder::planar || (draws_all && images.order == ChannelOrder::patches),
                "renderer {}: images: expected the channel order planar{}, got {}", name,
                draws_all ? " or patches" : "", name_of(images.order));
  check_patch_px(name, images.order, images.patch_px);
  PICTURA_CHECK(images.num_views >= 0 && static_cast<std::size_t>(images.num_views) == num_views,
                "renderer {}: images: expected images of {} views, got {}", name, num_views, images.num_views);
  PICTURA_CHECK(images.cameras.size() == rig.cameras.size(), "renderer {}: images: expected {} cameras, got {}", name,
                rig.cameras.size(), images.cameras.size());
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const CameraImages& camera = images.cameras[i];
    const Camera& wanted = rig.cameras[i];
    PICTURA_CHECK(camera.width_px == wanted.width_px && camera.height_px == wanted.height_px,
                  "renderer {}: images: camera {}: expected {}x{} pixels, got {}x{}", name, i, wanted.width_px,
                  wanted.height_px, camera.width_px, camera.height_px);
    PICTURA_CHECK(num_views == 0 || camera.data != nullptr, "renderer {}: images: camera {}: no memory for colour",
                  name, i);
    const int64_t values = image_values({camera.width_px, camera.height_px}, images.order, images.patch_px);
    PICTURA_CHECK(num_views < 2 || camera.view_stride >= values,
                  "renderer {}: images: camera {}: expected a view stride of at least {} values, got {}", name, i,
                  values, camera.view_stride);
  }
}

void check_scene(std::string_view renderer, const SceneBatch& scene, const HostGeometries& geometries) {
  check_device(renderer, "scene", Device{}, scene.device);
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
    const StaticGeometryView* const geometry = geometries.find(handle);
    PICTURA_CHECK(geometry != nullptr, "renderer {}: scene: world {}: expected a handle that holds a geometry, got {}",
                  renderer, world, handle);
    const int32_t lights = scene.light_begin[world + 1] - scene.light_begin[world];
    const int32_t signals = geometry->num_signals;
    PICTURA_CHECK(has_enough_lights(lights, signals),
                  "renderer {}: scene: world {}: expected a light state for each of {} signals, or none, got {}",
                  renderer, world, signals, lights);
    const int32_t boxes = scene.world_begin[world + 1] - scene.world_begin[world];
    PICTURA_CHECK(boxes <= kMaxBoxesPerWorld, "renderer {}: scene: world {}: expected at most {} agents, got {}",
                  renderer, world, kMaxBoxesPerWorld, boxes);
  }
  for (std::size_t i = 0; i < scene.hidden_agents.size(); ++i) {
    const int32_t agent = scene.hidden_agents[i];
    PICTURA_CHECK(agent >= 0 && static_cast<std::size_t>(agent) < scene.agents.size(),
                  "renderer {}: scene: hidden agent {}: expected an index below {}, got {}", renderer, i,
                  scene.agents.size(), agent);
  }
  for (std::size_t i = 0; i < scene.agents.size(); ++i) {
    const AgentBox& box = scene.agents[i];
    if (!box.drawn) continue;
    PICTURA_CHECK(is_finite(box.center_m) && is_direction(box.cos_heading, box.sin_heading),
                  "renderer {}: scene: agent {}: expected a finite pose, got ({}, {}, {}) m and heading ({}, {})",
                  renderer, i, box.center_m.x, box.center_m.y, box.center_m.z, box.cos_heading, box.sin_heading);
    PICTURA_CHECK(is_finite(box.length_m) && is_finite(box.width_m) && is_finite(box.height_m) && box.length_m >= 0 &&
                      box.width_m >= 0 && box.height_m >= 0,
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
    PICTURA_CHECK(has_valid_hidden_range(view, scene.hidden_agents.size()),
                  "renderer {}: view {}: expected hidden agents within a list of {}, got [{}, {})", renderer, i,
                  scene.hidden_agents.size(), view.hidden_begin, view.hidden_end);
    PICTURA_CHECK(has_finite_pose(view),
                  "renderer {}: view {}: expected a finite pose and a body length of 0 m or more, got ({}, {}, {}) m, "
                  "heading ({}, {}) and {} m",
                  renderer, i, view.origin_m.x, view.origin_m.y, view.origin_m.z, view.cos_heading, view.sin_heading,
                  view.body_length_m);
    PICTURA_CHECK(view.key.agent < RandomKey::kMaxAgents,
                  "renderer {}: view {}: expected a key's agent below {}, got {}", renderer, i, RandomKey::kMaxAgents,
                  view.key.agent);
  }
}

Span<const View> counted_views(std::string_view renderer, const ViewBatch& views) {
  if (views.num_views == nullptr) return views.views;
  const int32_t count = *views.num_views;
  PICTURA_CHECK(count >= 0 && static_cast<std::size_t>(count) <= views.size(),
                "renderer {}: number of views: expected 0 to {}, got {}", renderer, views.size(), count);
  return views.views.subspan(0, count);
}

void check_answers(std::string_view renderer, std::size_t num_queries, std::size_t num_answers) {
  PICTURA_CHECK(num_answers == num_queries, "renderer {}: visibility: expected {} values, got {}", renderer,
                num_queries, num_answers);
}

void check_queries(std::string_view renderer, const SceneBatch& scene, Span<const View> views, std::size_t max_views,
                   Span<const VisibilityQuery> queries, std::size_t num_answers) {
  check_answers(renderer, queries.size(), num_answers);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const VisibilityQuery& query = queries[i];
    PICTURA_CHECK(query.view >= 0 && static_cast<std::size_t>(query.view) < max_views,
                  "renderer {}: visibility query {}: expected a view below {}, got {}", renderer, i, max_views,
                  query.view);
    if (static_cast<std::size_t>(query.view) >= views.size()) continue;
    const auto world = static_cast<std::size_t>(views[query.view].world);
    const int32_t begin = scene.world_begin[world], end = scene.world_begin[world + 1];
    PICTURA_CHECK(query.agent >= begin && query.agent < end,
                  "renderer {}: visibility query {}: expected an agent of the view's world, {} to {}, got {}", renderer,
                  i, begin, end - 1, query.agent);
  }
}

void check_handle(std::string_view renderer, GeometryHandle handle) {
  PICTURA_CHECK(handle >= 0 && handle < kNumGeometryHandles,
                "renderer {}: geometry: expected a handle of 0 to {}, got {}", renderer, kNumGeometryHandles - 1,
                handle);
}

void check_reserved(std::string_view renderer, int max_views, int max_boxes) {
  PICTURA_CHECK(max_views >= 0 && max_boxes >= 0,
                "renderer {}: reserve: expected 0 views and boxes or more, got {} views and {} boxes", renderer,
                max_views, max_boxes);
}

void check_geometry(std::string_view renderer, const StaticGeometry& geometry) {
  for (std::size_t i = 0; i < geometry.strips.size(); ++i) {
    const Strip& strip = geometry.strips[i];
    PICTURA_CHECK(is_finite(strip.a_m) && is_finite(strip.b_m) && is_finite(strip.side_a) && is_finite(strip.side_b) &&
                      is_finite(strip.width_m) && strip.width_m >= 0,
                  "renderer {}: geometry: strip {}: expected finite ends and a width of 0 m or more", renderer, i);
    check_color(renderer, "strip", i, strip.color);
    PICTURA_CHECK(static_cast<int>(strip.kind) < kNumStripKinds,
                  "renderer {}: geometry: strip {}: expected a kind below {}, got {}", renderer, i, kNumStripKinds,
                  static_cast<int>(strip.kind));
  }
  for (std::size_t i = 0; i < geometry.walls.size(); ++i) {
    const WallFace& wall = geometry.walls[i];
    PICTURA_CHECK(is_finite(wall.a_m) && is_finite(wall.b_m) && is_finite(wall.height_m) && wall.height_m >= 0,
                  "renderer {}: geometry: wall {}: expected finite ends and a height of 0 m or more", renderer, i);
    check_color(renderer, "wall", i, wall.color);
  }
  for (std::size_t i = 0; i < geometry.heads.size(); ++i) {
    const LightHead& head = geometry.heads[i];
    PICTURA_CHECK(is_finite(head.position_m) && is_direction(head.facing.x, head.facing.y),
                  "renderer {}: geometry: light head {}: expected a finite position and a unit facing", renderer, i);
    PICTURA_CHECK(head.cos_half_angle >= -1 && head.cos_half_angle <= 1,
                  "renderer {}: geometry: light head {}: expected the cosine of half an angle, got {}", renderer, i,
                  head.cos_half_angle);
    PICTURA_CHECK(head.signal >= 0 && head.signal < geometry.num_signals,
                  "renderer {}: geometry: light head {}: expected a signal below {}, got {}", renderer, i,
                  geometry.num_signals, head.signal);
  }
  check_grid(renderer, "strips", geometry.strips.size(), geometry.strip_grid);
  check_grid(renderer, "walls", geometry.walls.size(), geometry.wall_grid);
}

static_assert(kMaxLineFloor_px <= kGuardBand_px);

const RendererConfig& check_config(std::string_view renderer, const RendererConfig& config) {
  validate(config.rig);
  PICTURA_CHECK(config.line_floor_px >= 0 && config.line_floor_px <= kMaxLineFloor_px,
                "renderer {}: expected a line floor of 0 to {} pixels, got {}", renderer, kMaxLineFloor_px,
                config.line_floor_px);
  check_randomization(renderer, config.randomization);
  return config;
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
