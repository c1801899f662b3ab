#include "pictura/common/camera.h"

#include <cmath>

#include <toml++/toml.h>

#include "pictura/common/error.h"
#include "pictura/common/file.h"

namespace pictura {

namespace {

constexpr int kMaxSize_px = 8192;
constexpr std::size_t kMaxCameras = 64;

float radians(double degrees) { return static_cast<float>(degrees * (3.14159265358979323846 / 180.0)); }

}  // namespace

Rig paper_rig(int width_px, int height_px) {
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
    camera.focal_y_px = 1545.0f * static_cast<float>(height_px) / 1080.0f;
    camera.center_x_px = 0.5f * static_cast<float>(width_px);
    camera.center_y_px = 0.5f * static_cast<float>(height_px);
    camera.position_m = row.position_m;
    camera.yaw_rad = radians(row.yaw_deg);
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

Rig load_rig(const std::string& path) {
  toml::table table;
  try {
    table = toml::parse(read_file(path, 1 << 20), path);
  } catch (const toml::parse_error& error) {
    fail("{}:{}: {}", path, error.source().begin.line, error.description());
  }
  const toml::array* cameras = table["camera"].as_array();
  PICTURA_CHECK(cameras && !cameras->empty(), "{}: expected one or more [[camera]] tables", path);

  Rig rig;
  for (std::size_t i = 0; i < cameras->size(); ++i) {
    const toml::table* row = cameras->get(i)->as_table();
    PICTURA_CHECK(row, "{}: camera {}: expected a table", path, i);
    Camera camera;
    camera.name = (*row)["name"].value_or(fmt::format("camera{}", i));
    double width = 0, height = 0, focal_px = 0, center_x_px = -1, center_y_px = -1, yaw_deg = 0, pitch_deg = 0,
           roll_deg = 0;
    double x_m = 0, y_m = 0, z_m = 0;
    for (const auto& [key, value] : *row) {
      const std::string_view name = key.str();
      if (name == "name") continue;
      const auto number = value.value<double>();
      PICTURA_CHECK(number.has_value(), "{}:{}: camera {} '{}': {}: expected a number", path, value.source().begin.line,
                    i, camera.name, name);
      if (name == "width_px")
        width = *number;
      else if (name == "height_px")
        height = *number;
      else if (name == "focal_px")
        focal_px = *number;
      else if (name == "center_x_px")
        center_x_px = *number;
      else if (name == "center_y_px")
        center_y_px = *number;
      else if (name == "x_m")
        x_m = *number;
      else if (name == "y_m")
        y_m = *number;
      else if (name == "z_m")
        z_m = *number;
      else if (name == "yaw_deg")
        yaw_deg = *number;
      else if (name == "pitch_deg")
        pitch_deg = *number;
      else if (name == "roll_deg")
        roll_deg = *number;
      else
        fail(
            "{}:{}: camera {} '{}': unknown key '{}'; known: name width_px height_px focal_px center_x_px "
            "center_y_px x_m y_m z_m yaw_deg pitch_deg roll_deg",
            path, value.source().begin.line, i, camera.name, name);
    }
    PICTURA_CHECK(width >= 1 && width <= kMaxSize_px && height >= 1 && height <= kMaxSize_px,
                  "{}: camera {} '{}': expected a size of 1x1 to {}x{} pixels, got {}x{}", path, i, camera.name,
                  kMaxSize_px, kMaxSize_px, width, height);
    camera.width_px = static_cast<int>(width);
    camera.height_px = static_cast<int>(height);
    camera.focal_x_px = camera.focal_y_px = static_cast<float>(focal_px);
    camera.center_x_px = static_cast<float>(center_x_px < 0 ? 0.5 * camera.width_px : center_x_px);
    camera.center_y_px = static_cast<float>(center_y_px < 0 ? 0.5 * camera.height_px : center_y_px);
    camera.position_m = {static_cast<float>(x_m), static_cast<float>(y_m), static_cast<float>(z_m)};
    camera.yaw_rad = radians(yaw_deg);
    camera.pitch_rad = radians(pitch_deg);
    camera.roll_rad = radians(roll_deg);
    rig.cameras.push_back(camera);
  }
  try {
    validate(rig);
  } catch (const Error& error) {
    fail("{}: {}", path, error.what());
  }
  return rig;
}

CameraAxes camera_axes(const Camera& camera) {
  const SinCos yaw = sincos_of(camera.yaw_rad), pitch = sincos_of(camera.pitch_rad), roll = sincos_of(camera.roll_rad);
  const Vec3 forward{yaw.cos * pitch.cos, yaw.sin * pitch.cos, pitch.sin};
  const Vec3 level_right{yaw.sin, -yaw.cos, 0};
  const Vec3 level_down = cross(forward, level_right);
  return {level_right * roll.cos + level_down * roll.sin, level_down * roll.cos - level_right * roll.sin, forward};
}

}  // namespace pictura
