#include "pictura/common/camera.h"

#include <cmath>
#include <set>

#include <Eigen/Geometry>

#include "pictura/common/error.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/regular_file.h"
#include "pictura/common/support/toml_fields.h"

namespace pictura {

namespace {

constexpr int kMaxSize_px = 8192;

}  // namespace

Rig paper_rig(int width_px, int height_px, bool square_pixels) {
  struct Row {
    const char* name;
    Vec3 position_m;
    double yaw_deg;
  };
  const Row rows[] = {{"front", {1.66f, -0.01f, 1.49f}, 0},
                      {"front_left", {1.63f, 0.12f, 1.48f}, 55},
                      {"front_right", {1.62f, -0.16f, 1.49f}, -55},
                      {"back", {-0.47f, 0.02f, 1.43f}, 180}};
  Rig rig;
  for (const Row& row : rows) {
    Camera camera;
    camera.name = row.name;
    camera.width_px = width_px;
    camera.height_px = height_px;
    camera.focal_x_px = 1545.0f * static_cast<float>(width_px) / 1920.0f;
    camera.focal_y_px = square_pixels ? camera.focal_x_px : 1545.0f * static_cast<float>(height_px) / 1080.0f;
    camera.center_x_px = 0.5f * static_cast<float>(width_px);
    camera.center_y_px = 0.5f * static_cast<float>(height_px);
    camera.position_m = row.position_m;
    camera.yaw_rad = radians_of(row.yaw_deg);
    rig.cameras.push_back(camera);
  }
  validate(rig);
  return rig;
}

void validate(const Rig& rig) {
  PICTURA_CHECK(!rig.cameras.empty() && rig.cameras.size() <= kMaxCameras, "rig: expected 1 to {} cameras, got {}",
                kMaxCameras, rig.cameras.size());
  for (std::size_t i = 0; i < rig.cameras.size(); ++i) {
    const Camera& c = rig.cameras[i];
    const std::string where = fmt::format("rig: camera {} '{}'", i, c.name);
    PICTURA_CHECK(c.width_px >= 1 && c.width_px <= kMaxSize_px && c.height_px >= 1 && c.height_px <= kMaxSize_px,
                  "{}: expected a size of 1x1 to {}x{} pixels, got {}x{}", where, kMaxSize_px, kMaxSize_px, c.width_px,
                  c.height_px);
    PICTURA_CHECK(std::isfinite(c.focal_x_px) && std::isfinite(c.focal_y_px) && c.focal_x_px > 0 && c.focal_y_px > 0,
                  "{}: expected positive focal lengths in pixels, got {} and {}", where, c.focal_x_px, c.focal_y_px);
    for (const float value : {c.center_x_px, c.center_y_px, c.position_m.x, c.position_m.y, c.position_m.z, c.yaw_rad,
                              c.pitch_rad, c.roll_rad}) {
      PICTURA_CHECK(std::isfinite(value), "{}: expected finite numbers in its pose and principal point, got {}", where,
                    value);
    }
  }
}

Rig read_cameras(TomlFields* fields_inout) {
  Rig rig;
  std::set<std::string> names;
  for (TomlFields& row : fields_inout->tables("camera")) {
    constexpr TomlFields::Range kSize_px{1, kMaxSize_px}, kFocal_px{1e-3, 1e6}, kAny{-1e6, 1e6};
    Camera camera;
    camera.name = row.file_name("name", fmt::format("camera{}", rig.cameras.size()));
    row.rename(fmt::format("camera {} '{}'", rig.cameras.size(), camera.name));
    if (!names.insert(camera.name).second) row.throw_error("name", fmt::format("'{}' is already used", camera.name));
    camera.width_px = row.integer("width_px", kSize_px);
    camera.height_px = row.integer("height_px", kSize_px);
    camera.focal_x_px = camera.focal_y_px = row.number("focal_px", kFocal_px);
    camera.center_x_px = row.number("center_x_px", kAny, 0.5f * static_cast<float>(camera.width_px));
    camera.center_y_px = row.number("center_y_px", kAny, 0.5f * static_cast<float>(camera.height_px));
    camera.position_m = {row.number("x_m", kAny, 0), row.number("y_m", kAny, 0), row.number("z_m", kAny, 0)};
    camera.yaw_rad = radians_of(row.number("yaw_deg", kAny, 0));
    camera.pitch_rad = radians_of(row.number("pitch_deg", kAny, 0));
    camera.roll_rad = radians_of(row.number("roll_deg", kAny, 0));
    row.reject_unknown_keys();
    rig.cameras.push_back(camera);
  }
  return rig;
}

Rig load_rig(const std::string& path) {
  require_regular_file(path);
  const toml::table table = parse_toml(read_file(path, 1 << 20), path);
  TomlFields fields(table, path);
  const Rig rig = read_cameras(&fields);
  fields.reject_unknown_keys();
  PICTURA_CHECK(!rig.cameras.empty(), "{}: expected one or more [[camera]] tables", path);
  try {
    validate(rig);
  } catch (const Error& error) {
    fail("{}: {}", path, error.what());
  }
  return rig;
}

CameraAxes camera_axes(const Camera& camera) {
  using Eigen::AngleAxisd, Eigen::Vector3d;
  // The columns are the camera's right, down and forward, in a frame with x forward, y left and z up. The matrix is
  // rotated axis by axis, because with a quaternion, horizontal directions would be horizontal only up to rounding.
  Eigen::Matrix3d axes;
  axes << 0, 0, 1, -1, 0, 0, 0, -1, 0;
  axes = AngleAxisd(camera.roll_rad, Vector3d::UnitX()).toRotationMatrix() * axes;
  axes = AngleAxisd(-camera.pitch_rad, Vector3d::UnitY()).toRotationMatrix() * axes;
  axes = AngleAxisd(camera.yaw_rad, Vector3d::UnitZ()).toRotationMatrix() * axes;
  const Eigen::Matrix3f rounded = axes.cast<float>();
  auto column = [&](int i) { return Vec3{rounded(0, i), rounded(1, i), rounded(2, i)}; };
  return {column(0), column(1), column(2)};
}

}  // namespace pictura
