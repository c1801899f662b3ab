#include "pictura/policy/policy_json.h"

#include "pictura/common/error.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/observation_arrays.h"

namespace pictura {

using nlohmann::ordered_json;

ordered_json schema_to_json(const Config& config) {
  ordered_json result;
  for (const ObservationArray& array : kObservationArrays) {
    if (array.type != ElementType::f32 || !config.reads(array.part)) continue;
    ordered_json& shape = result[std::string(array.name)];
    if (array.rows > 1)
      shape = {array.rows, array.features};
    else
      shape = {array.features};
  }
  result["actions"] = {kNumLongActions, kNumLatActions};
  return result;
}

void check_schema(const ordered_json& saved, const Config& config, const std::string& path) {
  const ordered_json expected = schema_to_json(config);
  for (const auto& [name, shape] : expected.items()) {
    PICTURA_CHECK(saved.contains(name), "{}: observation schema: {}: expected {}, got no value", path, name,
                  shape.dump());
    const ordered_json& got = saved.at(name);
    PICTURA_CHECK(got == shape, "{}: observation schema: {}: expected {}, got {}", path, name, shape.dump(),
                  got.dump());
  }
}

ordered_json rig_to_json(const Rig& rig) {
  ordered_json cameras = ordered_json::array();
  for (const Camera& c : rig.cameras) {
    cameras.push_back({{"name", c.name},
                       {"size_px", {c.width_px, c.height_px}},
                       {"focal_px", {c.focal_x_px, c.focal_y_px}},
                       {"center_px", {c.center_x_px, c.center_y_px}},
                       {"position_m", {c.position_m.x, c.position_m.y, c.position_m.z}},
                       {"yaw_pitch_roll_rad", {c.yaw_rad, c.pitch_rad, c.roll_rad}}});
  }
  return cameras;
}

Rig rig_from_json(const ordered_json& cameras) {
  Rig rig;
  for (const ordered_json& json : cameras) {
    Camera c;
    c.name = json.at("name");
    c.width_px = json.at("size_px").at(0);
    c.height_px = json.at("size_px").at(1);
    c.focal_x_px = json.at("focal_px").at(0);
    c.focal_y_px = json.at("focal_px").at(1);
    c.center_x_px = json.at("center_px").at(0);
    c.center_y_px = json.at("center_px").at(1);
    c.position_m = {json.at("position_m").at(0), json.at("position_m").at(1), json.at("position_m").at(2)};
    c.yaw_rad = json.at("yaw_pitch_roll_rad").at(0);
    c.pitch_rad = json.at("yaw_pitch_roll_rad").at(1);
    c.roll_rad = json.at("yaw_pitch_roll_rad").at(2);
    rig.cameras.push_back(c);
  }
  validate(rig);
  return rig;
}

}  // namespace pictura
