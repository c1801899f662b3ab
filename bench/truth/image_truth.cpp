#include "pictura/bench/truth/image_truth.h"

#include <algorithm>
#include <cmath>
#include <iterator>
#include <limits>
#include <utility>

#include <Eigen/Geometry>

#include "pictura/bench/truth/tolerances.h"
#include "pictura/common/raster/shapes.h"

namespace pictura {

namespace {

using Eigen::Matrix3d;
using Eigen::Vector3d;

Vector3d point(Vec3 v) { return {v.x, v.y, v.z}; }

constexpr double kFar = std::numeric_limits<double>::infinity();

// A face of a solid in camera coordinates: a parallelogram or a disk.
struct Facet {
  Vector3d origin, u, v;  // corner and sides; for a disk, centre and two radii
  bool is_disk = false;
  Rgb color;
  int solid = 0;  // index into Tracer::solids
  // Returns the depth of the hit along the ray (x, y, 1), or kFar.
  double hit(const Vector3d& ray) const {
    const Vector3d normal = u.cross(v);
    const double along = normal.dot(ray);
    if (along == 0) return kFar;
    const double depth = normal.dot(origin) / along;
    if (!(depth >= kNear_m)) return kFar;
    const Vector3d p = ray * depth - origin;
    // The general formula, because the sides of a wall on a slope are not at right angles.
    const double area2 = normal.squaredNorm();
    const double at_u = p.cross(v).dot(normal) / area2, at_v = u.cross(p).dot(normal) / area2;
    if (is_disk) return at_u * at_u + at_v * at_v <= 1 ? depth : kFar;
    return at_u >= 0 && at_u <= 1 && at_v >= 0 && at_v <= 1 ? depth : kFar;
  }
  Vector3d center() const { return is_disk ? origin : Vector3d(origin + 0.5 * (u + v)); }
  double radius() const { return is_disk ? u.norm() : 0.5 * std::max((u + v).norm(), (u - v).norm()); }
};

// The object that a facet belongs to: its footprint in the world, and its class and instance.
struct Solid {
  std::vector<Vector3d> footprint;  // corners
  uint8_t class_id = 0;
  uint16_t instance_id = 0;
  Vector3d middle() const {
    Vector3d sum = Vector3d::Zero();
    for (const Vector3d& corner : footprint) sum += corner;
    return sum / static_cast<double>(footprint.size());
  }
};

// A strip after widening: the cone of directions that its sides and ends bound, and the strip's plane.
struct PaintedStrip {
  // Inward normals of the sides; 0 if a side does not bound the strip.
  Vector3d edge_normal[4] = {Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero(), Vector3d::Zero()};
  bool crosses_near = false;          // whether the strip crosses the near plane; each ray is then tested
  Vector3d plane = Vector3d::Zero();  // unit normal
  double offset = 0;
  double nearest_m = 0, farthest_m = 0;  // minimum and maximum depth of the strip's corners
  uint32_t rank = 0;
  uint8_t class_id = 0;
  Rgb color;
  bool from_below = false;   // whether the camera is below the strip's plane
  std::vector<int> carries;  // indices of the solids on the strip
  bool carries_solid_of(const Facet& facet) const {
    return std::find(carries.begin(), carries.end(), facet.solid) != carries.end();
  }
  bool covers(const Vector3d& ray) const {
    for (const Vector3d& normal : edge_normal) {
      if (normal.dot(ray) < 0) return false;
    }
    if (!crosses_near) return true;
    // Widening can extend a strip beyond the horizon of its plane. There, the plane is behind the camera.
    const double of_plane = offset / plane.dot(ray);
    return of_plane >= kNear_m || of_plane <= 0;
  }
  // Returns the depth of the strip's plane, clamped to half the minimum and twice the maximum depth of the corners.
  // Beyond the horizon, it is that maximum.
  double depth(const Vector3d& ray) const {
    const double of_plane = offset / plane.dot(ray);
    const double highest = farthest_m * kWidenedDepth;
    return of_plane > 0 ? std::clamp(of_plane, nearest_m / kWidenedDepth, highest) : highest;
  }
  double height_of(const Vector3d& p) const { return plane.dot(p) - offset; }
};

struct Tracer {
  std::vector<Solid> solids;
  std::vector<Facet> facets;
  std::vector<PaintedStrip> strips;
};

// Rays through a rectangle of the image.
struct Cone {
  Vector3d corner[4], middle;
  double middle2 = 0, spread = 0;
  template <typename RayAt>
  Cone(RayAt&& ray_at, double x_low, double y_low, double x_high, double y_high)
      : corner{ray_at(x_low, y_low), ray_at(x_high, y_low), ray_at(x_low, y_high), ray_at(x_high, y_high)},
        middle(ray_at(0.5 * (x_low + x_high), 0.5 * (y_low + y_high))),
        middle2(middle.squaredNorm()),
        spread((corner[3] - corner[0]).norm()) {}
  // Whether the facet's bounding ball touches the cone.
  bool may_intersect(const Facet& facet) const {
    const Vector3d center = facet.center();
    const double along = center.dot(middle) / middle2;
    const Vector3d off = center - middle * along;
    const double reach = facet.radius() + spread * (std::abs(along) + facet.radius());
    return off.squaredNorm() <= reach * reach;
  }
  // Whether the cone may touch the strip: returns false if the whole cone is on the outer side of one edge.
  bool may_intersect(const PaintedStrip& strip) const {
    return std::none_of(std::begin(strip.edge_normal), std::end(strip.edge_normal), [&](const Vector3d& normal) {
      return std::all_of(std::begin(corner), std::end(corner),
                         [&](const Vector3d& ray) { return normal.dot(ray) < 0; });
    });
  }
};

class Eye {
 public:
  Eye(const Camera& camera, const View& view) {
    const double yaw = camera.yaw_rad, pitch = camera.pitch_rad, roll = camera.roll_rad;
    const Vector3d ahead{std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch)};
    const Vector3d level_right{std::sin(yaw), -std::cos(yaw), 0};
    const Vector3d level_down = ahead.cross(level_right);
    const double shrink = std::min(1.0, view.body_length_m / 4.5);
    Matrix3d of_body, axes;
    of_body << view.cos_heading, -view.sin_heading, 0, view.sin_heading, view.cos_heading, 0, 0, 0, 1;
    axes << level_right * std::cos(roll) + level_down * std::sin(roll),
        level_down * std::cos(roll) - level_right * std::sin(roll), ahead;
    to_camera_ = (of_body * axes).transpose();
    position_ = point(view.origin_m) +
                of_body * Vector3d{camera.position_m.x * shrink, camera.position_m.y, camera.position_m.z};
  }
  const Vector3d& position() const { return position_; }
  Vector3d direction(const Vector3d& d) const { return to_camera_ * d; }
  Vector3d operator()(const Vector3d& world) const { return direction(world - position_); }

 private:
  Matrix3d to_camera_;  // rows right, down, forward
  Vector3d position_;
};

// Brightness by face_brightness(), the rule of all renderers, from corners in double precision.
double brightness(const Vector3d* corners, int count) {
  Vec3 shared[4];
  for (int i = 0; i < count; ++i) {
    const Eigen::Vector3f rounded = corners[i].cast<float>();
    shared[i] = {rounded.x(), rounded.y(), rounded.z()};
  }
  return face_brightness(shared, count);
}

void add_rectangle(Tracer* tracer, const Eye& eye, const Vector3d& origin, const Vector3d& u, const Vector3d& v,
                   Rgb color) {
  const Vector3d corners[4] = {eye(origin), eye(origin + u), eye(origin + u + v), eye(origin + v)};
  const double fade = brightness(corners, 4);
  if (fade <= 0) return;
  tracer->facets.push_back({corners[0], corners[1] - corners[0], corners[3] - corners[0], false,
                            color * static_cast<float>(fade), static_cast<int>(tracer->solids.size()) - 1});
}

void add_agent(Tracer* tracer, const Eye& eye, const AgentBox& box, uint16_t instance_id) {
  const Vector3d ahead{box.cos_heading, box.sin_heading, 0}, left{-box.sin_heading, box.cos_heading, 0};
  const Vector3d length = ahead * box.length_m, width = left * box.width_m, height{0, 0, box.height_m};
  const Vector3d rear_right = point(box.center_m) - length * 0.5 - width * 0.5;
  tracer->solids.push_back({{rear_right, rear_right + length, rear_right + length + width, rear_right + width},
                            static_cast<uint8_t>(1 + static_cast<int>(box.agent_class)),
                            instance_id});
  const Vector3d to_eye = eye.position() - point(box.center_m);
  auto color = [&](BoxFace face) { return agent_color(box.agent_class, face); };
  if (to_eye.dot(ahead) > 0.5 * box.length_m) {
    add_rectangle(tracer, eye, rear_right + length, width, height, color(BoxFace::front));
  }
  if (to_eye.dot(ahead) < -0.5 * box.length_m) {
    add_rectangle(tracer, eye, rear_right, width, height, color(BoxFace::back));
  }
  if (to_eye.dot(left) > 0.5 * box.width_m) {
    add_rectangle(tracer, eye, rear_right + width, length, height, color(BoxFace::left));
  }
  if (to_eye.dot(left) < -0.5 * box.width_m) {
    add_rectangle(tracer, eye, rear_right, length, height, color(BoxFace::right));
  }
  if (to_eye.z() > box.height_m) add_rectangle(tracer, eye, rear_right + height, length, width, color(BoxFace::top));
  if (to_eye.z() < 0) add_rectangle(tracer, eye, rear_right, length, width, color(BoxFace::top));
}

void add_wall(Tracer* tracer, const Eye& eye, const WallFace& wall) {
  const Vector3d a = point(wall.a_m), b = point(wall.b_m);
  tracer->solids.push_back({{a, b}, static_cast<uint8_t>(SurfaceClass::wall), 0});
  add_rectangle(tracer, eye, a, b - a, {0, 0, wall.height_m}, wall.color);
}

void add_light(Tracer* tracer, const Eye& eye, const LightHead& head, LightState state) {
  if (state == LightState::unknown) return;
  const Vector3d center = point(head.position_m), facing{head.facing.x, head.facing.y, 0};
  Vector3d to_eye = eye.position() - center;
  to_eye.z() = 0;
  if (to_eye.dot(facing) <= 0 || to_eye.dot(facing) < head.cos_half_angle * to_eye.norm()) return;
  const Vector3d left{-head.facing.y, head.facing.x, 0};
  const Vector3d at = eye(center);
  const double fade = brightness(&at, 1);
  if (fade <= 0) return;
  tracer->solids.push_back({{center - left * kLightRadius_m - Vector3d{0, 0, kLightRadius_m},
                             center + left * kLightRadius_m - Vector3d{0, 0, kLightRadius_m}},
                            static_cast<uint8_t>(SurfaceClass::light),
                            0});
  tracer->facets.push_back({at, eye.direction(left * kLightRadius_m), eye.direction({0, 0, kLightRadius_m}), true,
                            light_color(state) * static_cast<float>(fade),
                            static_cast<int>(tracer->solids.size()) - 1});
}

// Whether two convex outlines overlap on the ground plane: to separate them along the normal of any side, one must move
// by more than a millimetre.
bool overlap_on_ground(const std::vector<Vector3d>& a, const std::vector<Vector3d>& b) {
  auto separates = [&](const Vector3d& normal) {
    double low_a = kFar, high_a = -kFar, low_b = kFar, high_b = -kFar;
    for (const Vector3d& p : a) low_a = std::min(low_a, normal.dot(p)), high_a = std::max(high_a, normal.dot(p));
    for (const Vector3d& p : b) low_b = std::min(low_b, normal.dot(p)), high_b = std::max(high_b, normal.dot(p));
    return std::min(high_a - low_b, high_b - low_a) <= 1e-3;
  };
  for (const std::vector<Vector3d>* outline : {&a, &b}) {
    for (std::size_t i = 0; i < outline->size(); ++i) {
      const Vector3d side = (*outline)[(i + 1) % outline->size()] - (*outline)[i];
      const double length = side.head<2>().norm();
      if (length > 1e-6 && separates({-side.y() / length, side.x() / length, 0})) return false;
    }
  }
  return true;
}

// Height of a point above the plane of an outline, along z.
double height_above(const std::vector<Vector3d>& outline, const Vector3d& p) {
  const Vector3d normal = (outline[2] - outline[0]).cross(outline[3] - outline[1]);
  return normal.dot(p - outline[0]) / normal.z();
}

// Returns the solids whose footprint overlaps the strip, if the centre of the footprint is at most kStanding_m above or
// below the strip's plane.
std::vector<int> solids_on(const Tracer& tracer, const std::vector<Vector3d>& outline) {
  std::vector<int> standing;
  for (std::size_t i = 0; i < tracer.solids.size(); ++i) {
    const double height_m = height_above(outline, tracer.solids[i].middle());
    if (std::abs(height_m) <= kStanding_m && overlap_on_ground(tracer.solids[i].footprint, outline)) {
      standing.push_back(static_cast<int>(i));
    }
  }
  return standing;
}

// Returns the point where the side of a strip from a to b crosses the near plane.
Vector3d at_near_plane(const Vector3d& a, const Vector3d& b) {
  return a + (b - a) * ((kNear_m - a.z()) / (b.z() - a.z()));
}

// Widens a strip to at least floor_px on screen, across its centre line. Only ends in front of the near plane are
// widened. Depths do not change. The corners are left and right of one end, then right and left of the other end.
void widen(const Camera& camera, double floor_px, Vector3d* corners) {
  // Normal of the plane through the camera and the centre line. It also gives the normal of the centre line on screen.
  const Vector3d through_eye = (corners[0] + corners[1]).cross(corners[2] + corners[3]);
  const Eigen::Array2d focal_px{camera.focal_x_px, camera.focal_y_px};
  Eigen::Vector2d across = through_eye.head<2>().array() / focal_px;
  if (across.isZero(0)) return;
  across.normalize();
  for (const auto& [left, right] : {std::pair{&corners[0], &corners[1]}, std::pair{&corners[3], &corners[2]}}) {
    if (left->z() < kNear_m || right->z() < kNear_m) continue;
    const Eigen::Array2d apart_px = focal_px * (left->hnormalized() - right->hnormalized()).array();
    const double width_px = across.dot(apart_px.matrix());
    const double push_px = std::copysign(0.5 * std::max(0.0, floor_px - std::abs(width_px)), width_px);
    const Eigen::Vector2d push = push_px * across.array() / focal_px;
    left->head<2>() += push * left->z();
    right->head<2>() -= push * right->z();
  }
}

void add_strip(Tracer* tracer, const Eye& eye, const Camera& camera, const Cone& image, float floor_px,
               const Strip& strip, uint32_t index) {
  Vec3 world[4];
  strip_corners(strip, world);
  Vector3d corners[4];
  for (int i = 0; i < 4; ++i) corners[i] = eye(point(world[i]));
  const double fade = brightness(corners, 4);
  if (fade <= 0) return;
  PaintedStrip painted;
  painted.plane = (corners[2] - corners[0]).cross(corners[3] - corners[1]);
  painted.plane /= std::max(1e-30, painted.plane.norm());
  painted.offset = painted.plane.dot(corners[0]);
  painted.class_id = static_cast<uint8_t>(kClassOfStrip + static_cast<int>(strip.kind));
  painted.rank = static_cast<uint32_t>(strip_rank(strip.kind)) << 28 | index;
  painted.color = strip.color * static_cast<float>(fade);
  Vector3d widened[4];
  std::copy(corners, corners + 4, widened);
  widen(camera, floor_px, widened);
  auto by_depth = [](const Vector3d& a, const Vector3d& b) { return a.z() < b.z(); };
  const auto [nearest, farthest] = std::minmax_element(corners, corners + 4, by_depth);
  if (farthest->z() < kNear_m) return;
  painted.crosses_near = nearest->z() < kNear_m;
  painted.nearest_m = std::max(nearest->z(), double{kNear_m});
  painted.farthest_m = farthest->z();
  // If the camera sees a strip edge-on, only the widened corners tell which side faces the camera.
  const Vector3d* const facing = painted.crosses_near ? corners : widened;
  const double side = (facing[2] - facing[0]).cross(facing[3] - facing[1]).dot(facing[0]) > 0 ? 1 : -1;
  for (int i = 0; i < 4; ++i) {
    const int next = (i + 1) % 4;
    Vector3d from = widened[i], to = widened[next];
    // A side that crosses the near plane runs from the near plane to the widened end. A side that is entirely closer
    // than the near plane bounds nothing.
    if (from.z() < kNear_m && to.z() < kNear_m) continue;
    if (from.z() < kNear_m || to.z() < kNear_m) {
      (from.z() < kNear_m ? from : to) = at_near_plane(corners[i], corners[next]);
    }
    painted.edge_normal[i] = side * from.cross(to);
  }
  if (!image.may_intersect(painted)) return;
  std::vector<Vector3d> outline;
  for (const Vec3& corner : world) outline.push_back(point(corner));
  painted.from_below = height_above(outline, eye.position()) < 0;
  painted.carries = solids_on(*tracer, outline);
  tracer->strips.push_back(painted);
}

// The surfaces that may be visible in a cone.
struct Candidates {
  std::vector<const Facet*> facets;
  std::vector<const PaintedStrip*> strips;
};

Candidates all_of(const Tracer& tracer) {
  Candidates all;
  for (const Facet& facet : tracer.facets) all.facets.push_back(&facet);
  for (const PaintedStrip& strip : tracer.strips) all.strips.push_back(&strip);
  return all;
}

Candidates within(const Candidates& candidates, const Cone& cone) {
  Candidates kept;
  for (const Facet* facet : candidates.facets) {
    if (cone.may_intersect(*facet)) kept.facets.push_back(facet);
  }
  for (const PaintedStrip* strip : candidates.strips) {
    if (cone.may_intersect(*strip)) kept.strips.push_back(strip);
  }
  return kept;
}

// The first hit of a ray.
struct Surface {
  const Rgb* color = nullptr;  // null if the ray hits nothing
  const Facet* facet = nullptr;
  const PaintedStrip* strip = nullptr;
  double depth = kFar;
};

bool are_equal(double depth, double other) { return std::abs(depth - other) < kEqualDepth * std::min(depth, other); }

// Returns the nearest solid. Among equally near solids, returns the first.
Surface first_solid(const Candidates& candidates, const Vector3d& ray) {
  Surface front;
  bool is_tie = false;
  for (const Facet* facet : candidates.facets) {
    const double at = facet->hit(ray);
    if (at == kFar) continue;
    is_tie |= front.facet && are_equal(at, front.depth);
    if (at < front.depth) front = {&facet->color, facet, nullptr, at};
  }
  if (!is_tie) return front;
  const double nearest = front.depth;
  for (const Facet* facet : candidates.facets) {
    const double at = facet->hit(ray);
    if (at < kFar && are_equal(at, nearest) && facet->solid < front.facet->solid) {
      front = {&facet->color, facet, nullptr, at};
    }
  }
  return front;
}

// Returns the nearest surface: the solid or strip of minimum depth, with two exceptions. Among strips whose planes are
// within kSameLevel_m of each other at the hit, the strip of lowest rank is in front. If a solid is on a strip, the
// solid is in front for a camera above the strip, and the strip is in front for a camera below.
Surface first_hit(const Candidates& candidates, const Vector3d& ray) {
  Surface front = first_solid(candidates, ray);
  struct Candidate {
    const PaintedStrip* strip;
    double depth;
  };
  std::vector<Candidate> strips;
  const Candidate* nearest = nullptr;
  strips.reserve(candidates.strips.size());
  for (const PaintedStrip* strip : candidates.strips) {
    if (!strip->covers(ray)) continue;
    if (front.facet && !strip->from_below && strip->carries_solid_of(*front.facet)) continue;
    strips.push_back({strip, strip->depth(ray)});
    if (!nearest || strips.back().depth < nearest->depth) nearest = &strips.back();
  }
  if (!nearest) return front;
  const PaintedStrip* painted = nearest->strip;
  double painted_depth = nearest->depth;
  const Vector3d there = ray * nearest->depth;
  for (const auto& [strip, depth] : strips) {
    const double gap_m = std::abs(strip->height_of(there) - nearest->strip->height_of(there));
    if (gap_m < kSameLevel_m && strip->rank < painted->rank) painted = strip, painted_depth = depth;
  }
  const bool is_nearer = painted_depth < front.depth && !are_equal(painted_depth, front.depth);
  if (!front.facet || is_nearer || (painted->from_below && painted->carries_solid_of(*front.facet))) {
    front = {&painted->color, nullptr, painted, std::clamp(painted_depth, painted->nearest_m, painted->farthest_m)};
  }
  return front;
}

}  // namespace

bool TruthImage::blank() const {
  return std::all_of(rgb.begin(), rgb.end(), [](float channel) { return channel == 0; });
}

namespace {

// Sampler of one camera's image of one view.
class ImageSampler {
 public:
  ImageSampler(const StaticGeometry& geometry, const SceneBatch& scene, const View& view, const Camera& camera,
               float line_floor_px)
      : camera_(camera), whole_(cone(0, 0, camera.width_px, camera.height_px)) {
    const Eye eye(camera, view);
    const auto world = static_cast<std::size_t>(view.world);
    for (int32_t i = scene.world_begin[world]; i < scene.world_begin[world + 1]; ++i) {
      const AgentBox& box = scene.agents[i];
      const auto hidden = scene.hidden_agents.subspan(view.hidden_begin, view.hidden_end - view.hidden_begin);
      if ((view.hides & kHidesAgents) != 0 || !box.drawn || i == view.ego_agent ||
          std::count(hidden.begin(), hidden.end(), i))
        continue;
      add_agent(&tracer_, eye, box, static_cast<uint16_t>(1 + i - scene.world_begin[world]));
    }
    for (const WallFace& wall : geometry.walls) add_wall(&tracer_, eye, wall);
    const auto lights = static_cast<std::size_t>(scene.light_begin[world]);
    if (scene.light_begin[world + 1] > scene.light_begin[world] && (view.hides & kHidesLights) == 0) {
      for (const LightHead& head : geometry.heads) {
        add_light(&tracer_, eye, head, scene.light_states[lights + static_cast<std::size_t>(head.signal)]);
      }
    }
    for (std::size_t i = 0; i < geometry.strips.size(); ++i) {
      add_strip(&tracer_, eye, camera, whole_, line_floor_px, geometry.strips[i], static_cast<uint32_t>(i));
    }
  }

  // Calls visit(x, y, candidates) for each pixel, where `candidates` are the surfaces that may be visible in the pixel.
  template <typename Visit>
  void for_each_pixel(Visit&& visit) const {
    // Surfaces are culled for the image, then for each row, then for each pixel.
    const Candidates in_image = within(all_of(tracer_), whole_);
    for (int y = 0; y < camera_.height_px; ++y) {
      const Candidates in_row = within(in_image, cone(0, y, camera_.width_px, y + 1));
      for (int x = 0; x < camera_.width_px; ++x) visit(x, y, within(in_row, cone(x, y, x + 1, y + 1)));
    }
  }

  Vector3d ray_at(double x, double y) const {
    return {(x - camera_.center_x_px) / camera_.focal_x_px, (y - camera_.center_y_px) / camera_.focal_y_px, 1};
  }
  const Tracer& tracer() const { return tracer_; }

 private:
  Cone cone(double x_low, double y_low, double x_high, double y_high) const {
    return Cone([this](double x, double y) { return ray_at(x, y); }, x_low, y_low, x_high, y_high);
  }

  Camera camera_;
  Cone whole_;
  Tracer tracer_;
};

// Returns the offsets of a pixel's samples from its corner.
std::vector<std::pair<double, double>> sample_offsets(TruthSamples samples) {
  if (samples == TruthSamples::center) return {{0.5, 0.5}};
  if (samples == TruthSamples::grid_2x2) return {{0.25, 0.25}, {0.75, 0.25}, {0.25, 0.75}, {0.75, 0.75}};
  // Additive recurrence on the plastic number (M. Roberts' R2 sequence).
  std::vector<std::pair<double, double>> offsets;
  for (int i = 0; i < 1024; ++i) {
    offsets.emplace_back(std::fmod(0.5 + 0.7548776662466927 * i, 1.0), std::fmod(0.5 + 0.5698402909980532 * i, 1.0));
  }
  return offsets;
}

}  // namespace

TruthImage trace_image(const StaticGeometry& geometry, const SceneBatch& scene, const View& view, const Camera& camera,
                       float line_floor_px, TruthSamples samples) {
  const ImageSampler sampler(geometry, scene, view, camera, line_floor_px);
  const auto offsets = sample_offsets(samples);
  const int width = camera.width_px, height = camera.height_px;
  const auto plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  TruthImage image{width,
                   height,
                   std::vector<float>(3 * plane),
                   std::vector<float>(plane),
                   std::vector<uint8_t>(plane),
                   std::vector<uint16_t>(plane)};
  sampler.for_each_pixel([&](int x, int y, const Candidates& in_pixel) {
    const std::size_t pixel = static_cast<std::size_t>(y * width + x);
    double sum[3] = {};
    for (const auto& [dx, dy] : offsets) {
      const Surface front = first_hit(in_pixel, sampler.ray_at(x + dx, y + dy));
      if (!front.color) continue;
      sum[0] += front.color->r;
      sum[1] += front.color->g;
      sum[2] += front.color->b;
    }
    for (std::size_t channel = 0; channel < 3; ++channel) {
      image.rgb[channel * plane + pixel] = static_cast<float>(sum[channel] / static_cast<double>(offsets.size()));
    }
    const Surface at_center = first_hit(in_pixel, sampler.ray_at(x + 0.5, y + 0.5));
    image.depth_m[pixel] = static_cast<float>(at_center.depth);
    if (at_center.strip) image.class_id[pixel] = at_center.strip->class_id;
    if (at_center.facet) {
      const Solid& solid = sampler.tracer().solids[at_center.facet->solid];
      image.class_id[pixel] = solid.class_id;
      image.instance_id[pixel] = solid.instance_id;
    }
  });
  return image;
}

TruthVisibility trace_visibility(const StaticGeometry& geometry, const SceneBatch& scene, const View& view,
                                 const Rig& rig, float line_floor_px, int32_t agent) {
  const auto offsets = sample_offsets(TruthSamples::low_discrepancy_1024);
  const int instance_id = 1 + agent - scene.world_begin[view.world];
  double visible = 0, alone = 0;
  for (const Camera& camera : rig.cameras) {
    const ImageSampler sampler(geometry, scene, view, camera, line_floor_px);
    auto is_wanted = [&](const Facet* facet) {
      return sampler.tracer().solids[facet->solid].instance_id == instance_id;
    };
    sampler.for_each_pixel([&](int x, int y, const Candidates& in_pixel) {
      Candidates wanted;
      std::copy_if(in_pixel.facets.begin(), in_pixel.facets.end(), std::back_inserter(wanted.facets), is_wanted);
      if (wanted.facets.empty()) return;
      for (const auto& [dx, dy] : offsets) {
        const Vector3d ray = sampler.ray_at(x + dx, y + dy);
        if (!first_hit(wanted, ray).facet) continue;
        const Surface front = first_hit(in_pixel, ray);
        alone += 1;
        visible += front.facet && is_wanted(front.facet);
      }
    });
  }
  return {visible / alone, alone / static_cast<double>(offsets.size())};
}

double value_error(double actual, double expected) {
  const double error = std::abs(actual - expected);
  return std::isfinite(error) ? error : std::numeric_limits<double>::infinity();
}

bool is_same_depth(double actual_m, double expected_m) {
  return actual_m == expected_m ||
         value_error(actual_m, expected_m) < kKernelDepthError * std::min(actual_m, expected_m);
}

namespace {

// Bin k counts errors of more than k - 1 and at most k steps. kRounding_steps allows for the rounding of floats that
// were converted from bytes.
constexpr double kStepsOfOne = 8 * 255, kRounding_steps = 1e-3;

std::size_t bin_of(double error) {
  return static_cast<std::size_t>(
      std::ceil(std::max(0.0, std::min(kStepsOfOne, error * kStepsOfOne - kRounding_steps))));
}

}  // namespace

void PooledError::add(const std::vector<float>& image, const std::vector<float>& truth) {
  for (std::size_t i = 0; i < image.size(); ++i) {
    const double error = value_error(image[i], truth[i]);
    squared_ += error * error;
    max_error_ = std::max(max_error_, error);
    ++histogram_[bin_of(error)];
  }
  count_ += image.size();
}

void PooledError::add(const PooledError& other) {
  squared_ += other.squared_;
  max_error_ = std::max(max_error_, other.max_error_);
  count_ += other.count_;
  for (std::size_t i = 0; i < histogram_.size(); ++i) histogram_[i] += other.histogram_[i];
}

double PooledError::psnr_db() const { return 10 * std::log10(static_cast<double>(count_) / squared_); }

double PooledError::share_above(double error) const {
  std::size_t above = 0;
  for (std::size_t i = bin_of(error) + 1; i < histogram_.size(); ++i) above += histogram_[i];
  return static_cast<double>(above) / static_cast<double>(count_);
}

}  // namespace pictura
