#include "pictura/tests/support/image_truth.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "pictura/common/raster_check.h"
#include "pictura/common/raster_shapes.h"

namespace pictura {

namespace {

struct Point {
  double x = 0, y = 0, z = 0;
};
Point operator+(Point a, Point b) { return {a.x + b.x, a.y + b.y, a.z + b.z}; }
Point operator-(Point a, Point b) { return {a.x - b.x, a.y - b.y, a.z - b.z}; }
Point operator*(Point a, double s) { return {a.x * s, a.y * s, a.z * s}; }
double dot(Point a, Point b) { return a.x * b.x + a.y * b.y + a.z * b.z; }
Point cross(Point a, Point b) { return {a.y * b.z - a.z * b.y, a.z * b.x - a.x * b.z, a.x * b.y - a.y * b.x}; }
Point point(Vec3 v) { return {v.x, v.y, v.z}; }

constexpr double kFar = std::numeric_limits<double>::infinity();

// A parallelogram or disk in camera coordinates: a solid's face.
struct Facet {
  Point origin, u, v;  // corner and sides; of a disk, centre and two radii
  bool is_disk = false;
  Rgb color;
  // Depth of the hit along the ray (x, y, 1), or kFar.
  double hit(Point ray) const {
    const Point normal = cross(u, v);
    const double along = dot(normal, ray);
    if (along == 0) return kFar;
    const double depth = dot(normal, origin) / along;
    if (!(depth >= kNear_m)) return kFar;
    const Point p = ray * depth - origin;
    // The sides of a wall with a sloping foot are not at right angles.
    const double area2 = dot(normal, normal);
    const double at_u = dot(cross(p, v), normal) / area2, at_v = dot(cross(u, p), normal) / area2;
    if (is_disk) return at_u * at_u + at_v * at_v <= 1 ? depth : kFar;
    return at_u >= 0 && at_u <= 1 && at_v >= 0 && at_v <= 1 ? depth : kFar;
  }
  Point center() const { return is_disk ? origin : origin + (u + v) * 0.5; }
  double radius() const {
    return is_disk ? std::sqrt(dot(u, u)) : 0.5 * std::sqrt(std::max(dot(u + v, u + v), dot(u - v, u - v)));
  }
};

// A strip as drawn: the cone of directions through its four corners, and the plane that it is painted on.
struct PaintedStrip {
  Point edge_normal[4];  // inwards
  Point plane;
  double offset = 0;
  uint32_t rank = 0;
  Rgb color;
  bool covers(Point ray) const {
    for (const Point& normal : edge_normal) {
      if (dot(normal, ray) < 0) return false;
    }
    return true;
  }
  double depth(Point ray) const {
    const double depth = offset / dot(plane, ray);
    return depth > 0 ? depth : kFar;
  }
};

struct Tracer {
  std::vector<Facet> facets;
  std::vector<PaintedStrip> strips;
};

class Eye {
 public:
  Eye(const Camera& camera, const View& view) {
    const double yaw = camera.yaw_rad, pitch = camera.pitch_rad, roll = camera.roll_rad;
    const Point ahead{std::cos(yaw) * std::cos(pitch), std::sin(yaw) * std::cos(pitch), std::sin(pitch)};
    const Point level_right{std::sin(yaw), -std::cos(yaw), 0};
    const Point level_down = cross(ahead, level_right);
    const double shrink = std::min(1.0, view.body_length_m / 4.5);
    auto turned = [&](Point p) {
      return Point{p.x * view.cos_heading - p.y * view.sin_heading, p.x * view.sin_heading + p.y * view.cos_heading,
                   p.z};
    };
    right_ = turned(level_right * std::cos(roll) + level_down * std::sin(roll));
    down_ = turned(level_down * std::cos(roll) - level_right * std::sin(roll));
    forward_ = turned(ahead);
    position_ = point(view.origin_m) + turned({camera.position_m.x * shrink, camera.position_m.y, camera.position_m.z});
  }
  Point position() const { return position_; }
  Point direction(Point d) const { return {dot(right_, d), dot(down_, d), dot(forward_, d)}; }
  Point operator()(Point world) const { return direction(world - position_); }

 private:
  Point right_, down_, forward_, position_;
};

// Brightness by the shared rule, from corners of our own.
double brightness(const Point* corners, int count) {
  Vec3 shared[4];
  for (int i = 0; i < count; ++i) {
    shared[i] = {static_cast<float>(corners[i].x), static_cast<float>(corners[i].y), static_cast<float>(corners[i].z)};
  }
  return face_brightness(shared, count);
}

void add_rectangle(Tracer* tracer, const Eye& eye, Point origin, Point u, Point v, Rgb color) {
  const Point corners[4] = {eye(origin), eye(origin + u), eye(origin + u + v), eye(origin + v)};
  const double fade = brightness(corners, 4);
  if (fade <= 0) return;
  tracer->facets.push_back(
      {corners[0], corners[1] - corners[0], corners[3] - corners[0], false, color * static_cast<float>(fade)});
}

void add_agent(Tracer* tracer, const Eye& eye, const AgentBox& box) {
  const Point ahead{box.cos_heading, box.sin_heading, 0}, left{-box.sin_heading, box.cos_heading, 0};
  const Point length = ahead * box.length_m, width = left * box.width_m, height{0, 0, box.height_m};
  const Point rear_right = point(box.center_m) - length * 0.5 - width * 0.5;
  const Point to_eye = eye.position() - point(box.center_m);
  auto color = [&](BoxFace face) { return agent_color(box.agent_class, face); };
  if (dot(to_eye, ahead) > 0.5 * box.length_m) {
    add_rectangle(tracer, eye, rear_right + length, width, height, color(BoxFace::front));
  }
  if (dot(to_eye, ahead) < -0.5 * box.length_m) {
    add_rectangle(tracer, eye, rear_right, width, height, color(BoxFace::back));
  }
  if (dot(to_eye, left) > 0.5 * box.width_m) {
    add_rectangle(tracer, eye, rear_right + width, length, height, color(BoxFace::left));
  }
  if (dot(to_eye, left) < -0.5 * box.width_m) {
    add_rectangle(tracer, eye, rear_right, length, height, color(BoxFace::right));
  }
  if (to_eye.z > box.height_m) add_rectangle(tracer, eye, rear_right + height, length, width, color(BoxFace::top));
  if (to_eye.z < 0) add_rectangle(tracer, eye, rear_right, length, width, color(BoxFace::top));
}

void add_light(Tracer* tracer, const Eye& eye, const LightHead& head, LightState state) {
  if (state == LightState::off) return;
  const Point center = point(head.position_m), facing{head.facing.x, head.facing.y, 0};
  Point to_eye = eye.position() - center;
  to_eye.z = 0;
  if (dot(to_eye, facing) <= 0 || dot(to_eye, facing) < head.cos_half_angle * std::sqrt(dot(to_eye, to_eye))) return;
  const Point left{-head.facing.y, head.facing.x, 0};
  const Point at = eye(center);
  const double fade = brightness(&at, 1);
  if (fade <= 0) return;
  tracer->facets.push_back({at, eye.direction(left * kLightRadius_m), eye.direction({0, 0, kLightRadius_m}), true,
                            light_color(state) * static_cast<float>(fade)});
}

void add_strip(Tracer* tracer, const Eye& eye, const PinholeCamera& pinhole, float floor_px, const Strip& strip,
               uint32_t index) {
  Vec3 world[4];
  strip_corners(strip, world);
  Point corners[4];
  Vec3 widened[4];
  for (int i = 0; i < 4; ++i) {
    corners[i] = eye(point(world[i]));
    widened[i] = {static_cast<float>(corners[i].x), static_cast<float>(corners[i].y), static_cast<float>(corners[i].z)};
  }
  const double fade = brightness(corners, 4);
  if (fade <= 0 || !widen_strip(pinhole, floor_px, widened)) return;
  PaintedStrip painted;
  painted.plane = cross(corners[2] - corners[0], corners[3] - corners[1]);
  painted.offset = dot(painted.plane, corners[0]);
  painted.rank = static_cast<uint32_t>(strip_rank(strip.kind)) << 28 | index;
  painted.color = strip.color * static_cast<float>(fade);
  Point as_drawn[4];
  for (int i = 0; i < 4; ++i) as_drawn[i] = point(widened[i]);
  const double side = dot(cross(as_drawn[2] - as_drawn[0], as_drawn[3] - as_drawn[1]), as_drawn[0]) > 0 ? 1 : -1;
  for (int i = 0; i < 4; ++i) painted.edge_normal[i] = cross(as_drawn[i], as_drawn[(i + 1) % 4]) * side;
  tracer->strips.push_back(painted);
}

}  // namespace

bool TruthImage::blank() const {
  return std::all_of(rgb.begin(), rgb.end(), [](float channel) { return channel == 0; });
}

TruthImage trace_image(const StaticGeometry& geometry, const SceneBatch& scene, const View& view, const Camera& camera,
                       float line_floor_px, TruthSamples samples) {
  Rig rig;
  rig.cameras = {camera};
  const PinholeCamera pinhole = pinhole_cameras(rig)[0];
  const Eye eye(camera, view);
  Tracer tracer;
  const auto world = static_cast<std::size_t>(view.world);
  for (int32_t i = scene.world_begin[world]; i < scene.world_begin[world + 1]; ++i) {
    const AgentBox& box = scene.agents[static_cast<std::size_t>(i)];
    const auto hidden = scene.hidden_agents.subspan(static_cast<std::size_t>(view.hidden_begin),
                                                    static_cast<std::size_t>(view.hidden_end - view.hidden_begin));
    if (!box.drawn || i == view.ego_agent || std::count(hidden.begin(), hidden.end(), i)) continue;
    add_agent(&tracer, eye, box);
  }
  for (const WallFace& wall : geometry.walls) {
    add_rectangle(&tracer, eye, point(wall.a_m), point(wall.b_m) - point(wall.a_m), {0, 0, wall.height_m}, wall.color);
  }
  const auto lights = static_cast<std::size_t>(scene.light_begin[world]);
  if (scene.light_begin[world + 1] > scene.light_begin[world]) {
    for (const LightHead& head : geometry.heads) {
      add_light(&tracer, eye, head, scene.light_states[lights + static_cast<std::size_t>(head.signal)]);
    }
  }
  for (std::size_t i = 0; i < geometry.strips.size(); ++i) {
    add_strip(&tracer, eye, pinhole, line_floor_px, geometry.strips[i], static_cast<uint32_t>(i));
  }

  std::vector<double> offset_x, offset_y;
  if (samples == TruthSamples::grid_2x2) {
    offset_x = {0.25, 0.75, 0.25, 0.75};
    offset_y = {0.25, 0.25, 0.75, 0.75};
  } else {
    // Additive recurrence on the plastic number (M. Roberts' R2 sequence).
    for (int i = 0; i < 1024; ++i) {
      offset_x.push_back(std::fmod(0.5 + 0.7548776662466927 * i, 1.0));
      offset_y.push_back(std::fmod(0.5 + 0.5698402909980532 * i, 1.0));
    }
  }

  const int width = camera.width_px, height = camera.height_px;
  TruthImage image{width, height, std::vector<float>(static_cast<std::size_t>(3 * width * height))};
  auto ray_at = [&](double x, double y) {
    return Point{(x - camera.center_x_px) / camera.focal_x_px, (y - camera.center_y_px) / camera.focal_y_px, 1};
  };
  std::vector<const Facet*> near_facets;
  std::vector<const PaintedStrip*> near_strips;
  for (int y = 0; y < height; ++y) {
    for (int x = 0; x < width; ++x) {
      // What may appear in this pixel: facets whose ball touches the pixel's cone, strips not outside of one edge.
      const Point corner[4] = {ray_at(x, y), ray_at(x + 1, y), ray_at(x, y + 1), ray_at(x + 1, y + 1)};
      const Point middle = ray_at(x + 0.5, y + 0.5);
      const double middle2 = dot(middle, middle);
      const double spread = std::sqrt(dot(corner[3] - corner[0], corner[3] - corner[0]));
      near_facets.clear();
      for (const Facet& facet : tracer.facets) {
        const Point center = facet.center();
        const double along = dot(center, middle) / middle2;
        const Point off = center - middle * along;
        const double reach = facet.radius() + spread * (std::abs(along) + facet.radius());
        if (dot(off, off) <= reach * reach) near_facets.push_back(&facet);
      }
      near_strips.clear();
      for (const PaintedStrip& strip : tracer.strips) {
        const bool outside = std::any_of(std::begin(strip.edge_normal), std::end(strip.edge_normal), [&](Point normal) {
          return std::all_of(std::begin(corner), std::end(corner), [&](Point ray) { return dot(normal, ray) < 0; });
        });
        if (!outside) near_strips.push_back(&strip);
      }
      double sum[3] = {};
      for (std::size_t s = 0; s < offset_x.size(); ++s) {
        const Point ray = ray_at(x + offset_x[s], y + offset_y[s]);
        double depth = kFar;
        const Rgb* color = nullptr;
        for (const Facet* facet : near_facets) {
          const double at = facet->hit(ray);
          if (at < depth) {
            depth = at;
            color = &facet->color;
          }
        }
        const PaintedStrip* front = nullptr;
        double front_depth = kFar;
        for (const PaintedStrip* strip : near_strips) {
          if (!strip->covers(ray)) continue;
          const double at = strip->depth(ray);
          if (at < kNear_m) continue;
          const bool same = front && (at == front_depth || std::abs(at - front_depth) < 1e-3 * at);
          if (!front || (same ? strip->rank < front->rank : at < front_depth)) {
            front = strip;
            front_depth = at;
          }
        }
        if (front && (!color || front_depth < depth)) color = &front->color;
        if (!color) continue;
        sum[0] += color->r;
        sum[1] += color->g;
        sum[2] += color->b;
      }
      for (int channel = 0; channel < 3; ++channel) {
        image.rgb[static_cast<std::size_t>((channel * height + y) * width + x)] =
            static_cast<float>(sum[channel] / static_cast<double>(offset_x.size()));
      }
    }
  }
  return image;
}

void PooledError::add(const std::vector<float>& image, const std::vector<float>& truth) {
  for (std::size_t i = 0; i < image.size(); ++i) {
    const double error = std::abs(static_cast<double>(image[i]) - truth[i]);
    squared_ += error * error;
    max_error_ = std::max(max_error_, error);
    ++histogram_[static_cast<std::size_t>(std::min(1024.0, error * 1024))];
  }
  count_ += image.size();
}

double PooledError::psnr_db() const { return 10 * std::log10(static_cast<double>(count_) / squared_); }

double PooledError::share_above(double error) const {
  std::size_t above = 0;
  for (auto i = static_cast<std::size_t>(std::ceil(error * 1024)); i < histogram_.size(); ++i) above += histogram_[i];
  return static_cast<double>(above) / static_cast<double>(count_);
}

}  // namespace pictura
