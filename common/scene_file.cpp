#include "pictura/common/scene_file.h"

#include <array>
#include <filesystem>
#include <set>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/regular_file.h"
#include "pictura/common/support/toml_fields.h"

namespace pictura {

namespace {

using Range = TomlFields::Range;
// Sizes of 0 and half-angles of 0 would draw nothing.
constexpr Range kCoordinate_m{-1e4, 1e4}, kSize_m{1e-3, 1e3}, kHeading_deg{-360, 360}, kHalfAngle_deg{0.1, 180};
constexpr std::size_t kMaxAgents = 4096, kMaxViews = 4096, kMaxStrips = std::size_t{1} << 18;
constexpr float kMaxLine_m = 1e5f;

Vec3 position_of(TomlFields* row) {
  return {row->number("x_m", kCoordinate_m), row->number("y_m", kCoordinate_m), row->number("z_m", kCoordinate_m, 0)};
}

Rgb color_of(TomlFields* row, Rgb fallback) {
  if (!row->has("color_rgb")) return fallback;
  const std::vector<float> channels = row->numbers("color_rgb", {0, 255}, 3);
  return {channels[0] / 255, channels[1] / 255, channels[2] / 255};
}

AgentBox read_agent(TomlFields* row) {
  constexpr std::array<std::string_view, 3> kClasses{"vehicle", "cyclist", "pedestrian"};
  constexpr std::array<std::string_view, 3> kPalettes{"class", "halted", "parked"};
  const auto agent_class = static_cast<AgentClass>(row->choice("class", kClasses));
  const Vec3 center_m = position_of(row);
  const float heading_rad = radians_of(row->number("heading_deg", kHeading_deg, 0));
  const Vec3 size_m{row->number("length_m", kSize_m), row->number("width_m", kSize_m),
                    row->number("height_m", kSize_m)};
  AgentBox box = make_box(agent_class, center_m, heading_rad, size_m);
  box.palette = static_cast<uint8_t>(row->choice("palette", kPalettes, 0));
  box.drawn = row->flag("drawn", true);
  return box;
}

// Returns the painted pieces of a line as polylines: dashes of dash_m with gap_m between them, from the line's start.
std::vector<std::vector<Vec3>> dashes_of(const std::vector<Vec3>& points_m, float dash_m, float gap_m) {
  std::vector<std::vector<Vec3>> dashes;
  bool painted = true;
  float left_m = dash_m;  // remaining length of the current dash or gap
  std::vector<Vec3> dash{points_m[0]};
  auto close = [&] {
    if (painted && dash.size() >= 2) dashes.push_back(dash);
  };
  for (std::size_t i = 1; i < points_m.size(); ++i) {
    Vec3 from = points_m[i - 1];
    float rest_m = length(points_m[i] - from);
    while (rest_m > left_m) {
      from = from + (points_m[i] - from) * (left_m / rest_m);
      rest_m -= left_m;
      dash.push_back(from);
      close();
      painted = !painted;
      left_m = painted ? dash_m : gap_m;
      dash.assign(1, from);
    }
    left_m -= rest_m;
    dash.push_back(points_m[i]);
  }
  close();
  return dashes;
}

// Returns a line that is parallel to the line of the strips, with the same mitres.
std::vector<Strip> moved_aside(std::vector<Strip> strips, float left_m) {
  auto move = [&](Vec3* point, Vec2 side) { *point = *point + Vec3{left_m * side.x, left_m * side.y, 0}; };
  for (Strip& strip : strips) {
    move(&strip.a_m, strip.side_a);
    move(&strip.b_m, strip.side_b);
  }
  return strips;
}

void read_line(TomlFields* row, std::vector<Strip>* strips_out) {
  constexpr std::array<std::string_view, 4> kKinds{"lane_mark", "road_edge", "crosswalk", "stop_line"};
  constexpr std::array<std::string_view, 3> kStyles{"solid", "broken", "double"};
  constexpr std::array<std::string_view, 2> kColors{"white", "yellow"};
  enum Style { solid, broken, twofold };
  const auto kind = static_cast<StripKind>(row->choice("kind", kKinds));
  const Rgb white_or_yellow = row->choice("color", kColors, 0) == 0 ? kWhiteMarkColor : kYellowMarkColor;
  const Rgb color = color_of(row, kind == StripKind::road_edge   ? kRoadEdgeColor
                                  : kind == StripKind::crosswalk ? kCrosswalkColor
                                  : kind == StripKind::stop_line ? kStopLineColor
                                                                 : white_or_yellow);
  if (row->has("color") && (kind != StripKind::lane_mark || row->has("color_rgb"))) {
    row->throw_error("color", "is for lane marks without color_rgb");
  }
  const float width_m = row->number("width_m", kSize_m);
  std::vector<Vec3> points_m = row->points("points_m", kCoordinate_m, 2);
  if (row->flag("closed", false)) points_m.push_back(points_m.front());
  float length_m = 0;
  for (std::size_t i = 1; i < points_m.size(); ++i) length_m += length(points_m[i] - points_m[i - 1]);
  if (length_m > kMaxLine_m) row->throw_error("points_m", fmt::format("expected at most {} m of line", kMaxLine_m));
  const int style = row->choice("style", kStyles, solid);
  for (const char* key : {"dash_m", "gap_m"}) {
    if (row->has(key) && style != broken) row->throw_error(key, "is for broken lines");
  }
  if (row->has("spacing_m") && style != twofold) row->throw_error("spacing_m", "is for double lines");
  std::vector<Strip> strips;
  if (style == broken) {
    const float dash_m = row->number("dash_m", {0.1, 1e3}), gap_m = row->number("gap_m", {0.1, 1e3});
    for (const auto& dash : dashes_of(points_m, dash_m, gap_m)) append_strips(dash, width_m, color, kind, &strips);
  } else {
    append_strips(points_m, width_m, color, kind, &strips);
  }
  if (strips.empty()) row->throw_error("points_m", "expected points at different places");
  if (style == twofold) {
    const float aside_m = 0.5f * row->number("spacing_m", kSize_m);
    const std::vector<Strip> right = moved_aside(strips, -aside_m);
    strips = moved_aside(strips, aside_m);
    strips.insert(strips.end(), right.begin(), right.end());
  }
  if (strips_out->size() + strips.size() > kMaxStrips) {
    row->throw_error("points_m", fmt::format("expected at most {} pieces of lines in a scene", kMaxStrips));
  }
  strips_out->insert(strips_out->end(), strips.begin(), strips.end());
}

void read_wall(TomlFields* row, std::vector<WallFace>* walls_out) {
  const std::vector<Vec3> points_m = row->points("points_m", kCoordinate_m, 2);
  const float height_m = row->number("height_m", kSize_m);
  const Rgb color = color_of(row, kWallColor);
  for (std::size_t i = 1; i < points_m.size(); ++i) {
    if (length(points_m[i].xy() - points_m[i - 1].xy()) < 1e-3f) {
      row->throw_error("points_m", fmt::format("points {} and {} are at the same place", i - 1, i));
    }
    walls_out->push_back({points_m[i - 1], points_m[i], height_m, color});
  }
}

void read_light(TomlFields* row, SceneFile* out) {
  constexpr std::array<std::string_view, kNumLightStates> kStates{"off", "red", "yellow", "green", "unknown"};
  LightHead head;
  head.position_m = position_of(row);
  const SinCos facing = sincos_of(radians_of(row->number("facing_deg", kHeading_deg)));
  head.facing = {facing.cos, facing.sin};
  head.cos_half_angle = cos_of(radians_of(row->number("half_angle_deg", kHalfAngle_deg, 60)));
  head.signal = out->geometry.num_signals++;
  out->geometry.heads.push_back(head);
  out->scene.light_states.push_back(static_cast<LightState>(row->choice("state", kStates)));
}

View read_view(TomlFields* row, SceneOwner* scene_inout) {
  const Range agent_index{0, static_cast<double>(scene_inout->agents.size()) - 1};
  const Vec3 origin_m = position_of(row);
  View view = make_view(origin_m, radians_of(row->number("heading_deg", kHeading_deg)));
  if (row->has("ego")) {
    if (scene_inout->agents.empty()) row->throw_error("ego", "the scene has no agents");
    view.ego_agent = row->integer("ego", agent_index);
    view.body_length_m = scene_inout->agents[view.ego_agent].length_m;
  }
  view.body_length_m = row->number("body_length_m", kSize_m, view.body_length_m);
  view.hidden_begin = static_cast<int32_t>(scene_inout->hidden_agents.size());
  if (row->has("hidden")) {
    if (scene_inout->agents.empty()) row->throw_error("hidden", "the scene has no agents");
    std::set<int> hidden;
    for (const int agent : row->integers("hidden", agent_index, {})) {
      if (!hidden.insert(agent).second) row->throw_error("hidden", fmt::format("agent {} is listed twice", agent));
      scene_inout->hidden_agents.push_back(agent);
    }
  }
  view.hidden_end = static_cast<int32_t>(scene_inout->hidden_agents.size());
  return view;
}

void read_views(TomlFields* root, SceneFile* out) {
  std::set<std::string> names;
  for (TomlFields& row : root->tables("view")) {
    const std::string name = row.file_name("name", fmt::format("view{}", out->views.size()));
    if (!names.insert(name).second) row.throw_error("name", fmt::format("'{}' is already used", name));
    out->view_names.push_back(name);
    out->view_captions.push_back(row.text("caption", name));
    out->views.push_back(read_view(&row, &out->scene));
    row.reject_unknown_keys();
  }
  if (out->views.empty()) root->throw_error("view", "expected one or more [[view]] tables");
  if (out->views.size() > kMaxViews) root->throw_error("view", fmt::format("expected at most {} views", kMaxViews));
}

Rig read_rig(TomlFields* root, const std::string& source, const std::string& folder) {
  const Rig rig = read_cameras(root);
  const bool has_cameras = root->has("camera"), in_file = root->has("rig");
  if (has_cameras && rig.cameras.empty()) root->throw_error("camera", "expected one or more [[camera]] tables");
  if (in_file && has_cameras) root->throw_error("rig", "has no effect with [[camera]] tables");
  for (const char* key : {"size_px", "square_pixels"}) {
    if (root->has(key) && (has_cameras || in_file)) root->throw_error(key, "is only for the paper's cameras");
  }
  if (in_file) {
    const std::string path = (std::filesystem::path(folder) / root->text("rig", "")).string();
    try {
      return load_rig(path);
    } catch (const Error& error) {
      fail("{}: rig: {}", source, error.what());
    }
  }
  if (has_cameras) return rig;
  const bool square_pixels = root->flag("square_pixels", false);
  const std::vector<int> size_px = root->integers("size_px", {1, 8192}, {96, 54});
  if (size_px.size() != 2) root->throw_error("size_px", "expected [width, height]");
  return paper_rig(size_px[0], size_px[1], square_pixels);
}

}  // namespace

SceneFile parse_scene(const std::string& text, const std::string& source, const std::string& folder) {
  const toml::table table = parse_toml(text, source);
  TomlFields root(table, source);
  SceneFile out;
  out.config.rig = read_rig(&root, source, folder);
  out.config.line_floor_px = root.number("line_floor_px", {0, kMaxLineFloor_px}, out.config.line_floor_px);
  out.config.debug_palette = root.flag("debug_palette", false);
  for (TomlFields& row : root.tables("agent")) {
    out.scene.agents.push_back(read_agent(&row));
    row.reject_unknown_keys();
  }
  if (out.scene.agents.size() > kMaxAgents) root.throw_error("agent", fmt::format("expected at most {}", kMaxAgents));
  for (TomlFields& row : root.tables("line")) {
    read_line(&row, &out.geometry.strips);
    row.reject_unknown_keys();
  }
  for (TomlFields& row : root.tables("wall")) {
    read_wall(&row, &out.geometry.walls);
    row.reject_unknown_keys();
  }
  for (TomlFields& row : root.tables("light")) {
    read_light(&row, &out);
    row.reject_unknown_keys();
  }
  read_views(&root, &out);
  root.reject_unknown_keys();
  out.geometry.build_grids();
  out.scene.end_world(0);
  try {
    validate(out.config.rig);
  } catch (const Error& error) {
    fail("{}: {}", source, error.what());
  }
  return out;
}

SceneFile load_scene(const std::string& path) {
  require_regular_file(path);
  return parse_scene(read_file(path, 1 << 20), path, std::filesystem::path(path).parent_path().string());
}

}  // namespace pictura
