#include "pictura/drawing/world.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <utility>
#include <vector>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/drawing/map_layers.h"
#include "pictura/drawing/tracks.h"

namespace pictura {

using Eigen::Vector2d;

namespace {

constexpr int kTile_px = 512;
constexpr size_t kMaxTiles = 160;  // 160 MiB; the tiles of one picture may need more
constexpr Rgb kHaloColor = hex(0xFFE45C);

/// Position of the picture's top left corner relative to the map's origin, in whole pixels.
struct Corner {
  int x = 0, y = 0;
};

Corner corner_of(const TopCamera& camera, int width_px, int height_px) {
  return {static_cast<int>(std::lround(camera.center_m.x * camera.px_per_m - 0.5 * width_px)),
          static_cast<int>(std::lround(-camera.center_m.y * camera.px_per_m - 0.5 * height_px))};
}

Vector2d left_top_of(Corner corner, double px_per_m) { return {corner.x / px_per_m, -corner.y / px_per_m}; }

int floor_div(int a, int b) { return a / b - (a % b < 0); }

Rgb mixed(Rgb a, Rgb b, float share_of_b) {
  return {a.r + (b.r - a.r) * share_of_b, a.g + (b.g - a.g) * share_of_b, a.b + (b.b - a.b) * share_of_b};
}

/// Colours of an agent, those of its back (body) and its front (mark) in camera images. Parked and halted agents are
/// greyer.
struct AgentColors {
  Rgb body, mark;
};
AgentColors colors_of(AgentClass agent_class, AgentStatus status) {
  const Rgb body = agent_color(agent_class, BoxFace::back), mark = agent_color(agent_class, BoxFace::front);
  const Rgb grey = hex(0x9298A0);
  if (status == AgentStatus::parked) return {hex(0xC4C9D0), hex(0x9AA0A8)};
  if (status == AgentStatus::halted) return {mixed(body, grey, 0.75f), mixed(mark, grey, 0.75f)};
  return {body, mark};
}

void paint_agent(Canvas& canvas, const AgentBox& agent, AgentStatus status, const Vector2d& center_px,
                 double px_per_m) {
  cairo_t* context = canvas.context();
  // Large enough to be visible even if a pixel is a metre wide or more.
  const double length = std::max(agent.length_m * px_per_m, 7.0), width = std::max(agent.width_m * px_per_m, 4.0);
  const AgentColors colors = colors_of(agent.agent_class, status);
  cairo_save(context);
  cairo_translate(context, center_px.x(), center_px.y());
  // The y axis of pixels points down, so a counter-clockwise heading is a clockwise rotation here.
  cairo_rotate(context, -std::atan2(agent.sin_heading, agent.cos_heading));
  cairo_rectangle(context, -0.5 * length, -0.5 * width, length, width);
  canvas.set_color(colors.body);
  cairo_fill_preserve(context);
  cairo_set_line_width(context, 0.8);
  canvas.set_color(hex(0x14161A), 0.7);
  cairo_stroke(context);
  cairo_move_to(context, 0.5 * length, 0);
  cairo_line_to(context, 0.12 * length, -0.42 * width);
  cairo_line_to(context, 0.12 * length, 0.42 * width);
  cairo_close_path(context);
  canvas.set_color(colors.mark);
  cairo_fill(context);
  cairo_restore(context);
}

void paint_wall(GroundPen& pen, const WallFace& wall) {
  pen.line(in_plan(wall.a_m), in_plan(wall.b_m), pen.at_least(0.5, 1.5), hex(0x7A6552));
}

/// Reasons to halt, in the order of the legend. An agent's ring has the colour of the first reason that applies.
struct HaltReason {
  int events;
  const char* name;
  Rgb color;
};
constexpr HaltReason kHaltReasons[] = {{kEventCollision, "collision", hex(0xFF3B4E)},
                                       {kEventRedLight, "red light", hex(0xE23BD0)},
                                       {kEventWall, "wall", hex(0xC98A4B)},
                                       {kEventOffRoad, "off the road", hex(0xFF9A1F)}};

const HaltReason* reason_of(int events) {
  for (const HaltReason& reason : kHaltReasons) {
    if (events & reason.events) return &reason;
  }
  return nullptr;
}

void paint_goal(Canvas& canvas, const Vector2d& from_px, const Vector2d& to_px, AgentClass agent_class) {
  constexpr double kDot_px = 2.5;
  cairo_t* context = canvas.context();
  canvas.set_color(agent_color(agent_class, BoxFace::back), 0.55);
  cairo_set_line_width(context, 1);
  cairo_move_to(context, from_px.x(), from_px.y());
  cairo_line_to(context, to_px.x(), to_px.y());
  cairo_stroke(context);
  cairo_arc(context, to_px.x(), to_px.y(), kDot_px, 0, kTwoPi);
  cairo_fill(context);
}

void paint_halt(Canvas& canvas, const HaltReason& reason, const Vector2d& center_px, double length_px) {
  cairo_t* context = canvas.context();
  cairo_new_sub_path(context);
  cairo_arc(context, center_px.x(), center_px.y(), std::max(0.6 * length_px, 5.0), 0, kTwoPi);
  cairo_set_line_width(context, 2);
  canvas.set_color(reason.color);
  cairo_stroke(context);
}

void paint_mark(Canvas& canvas, const WorldMark& mark, const Vector2d& center_px) {
  const bool has_label = !mark.label.empty();
  cairo_t* context = canvas.context();
  cairo_new_sub_path(context);
  cairo_arc(context, center_px.x(), center_px.y(), has_label ? 5.5 : 3, 0, kTwoPi);
  canvas.set_color(mark.color);
  if (!has_label) {
    cairo_fill(context);
    return;
  }
  cairo_fill_preserve(context);
  canvas.set_color(hex(0x14161A));
  cairo_set_line_width(context, 1.2);
  cairo_stroke(context);
  canvas.text(center_px.x() + 8, center_px.y() - 6, mark.label, {.size_px = 15, .bold = true, .color = hex(0x14161A)});
}

/// Paints the number of active agents, and of halted agents by reason.
void paint_legend(Canvas& canvas, const WorldFrame& frame) {
  struct Row {
    std::string label;
    Rgb color;
  };
  const auto count = [&frame](auto&& counts) {
    int sum = 0;
    for (size_t i = 0; i < frame.agents.size(); ++i) sum += counts(frame.status[i], frame.halt_reason[i]);
    return sum;
  };
  const auto with = [&count](AgentStatus which) {
    return count([which](AgentStatus status, int) { return status == which; });
  };
  std::vector<Row> rows{
      {fmt::format("{} active", with(AgentStatus::active)), agent_color(AgentClass::vehicle, BoxFace::back)}};
  if (const int recorded = with(AgentStatus::recorded)) {
    rows.push_back({fmt::format("{} as recorded", recorded), agent_color(AgentClass::vehicle, BoxFace::front)});
  }
  for (const HaltReason& reason : kHaltReasons) {
    const int sum = count(
        [&](AgentStatus status, int events) { return status == AgentStatus::halted && reason_of(events) == &reason; });
    rows.push_back({fmt::format("{} {}", sum, reason.name), reason.color});
  }
  constexpr double kRow_px = 19, kMargin_px = 10, kWidth_px = 132;
  const double height = kRow_px * static_cast<double>(rows.size()) + 10;
  const double top = canvas.height_px() - kMargin_px - height;
  canvas.round_rectangle_path(kMargin_px, top, kWidth_px, height, 6);
  canvas.set_color(hex(0x14161A), 0.72);
  cairo_fill(canvas.context());
  for (size_t i = 0; i < rows.size(); ++i) {
    const double y = std::round(top + 5 + kRow_px * (static_cast<double>(i) + 0.5));
    canvas.fill_rectangle(kMargin_px + 9, y - 5, 10, 10, rows[i].color);
    canvas.text(kMargin_px + 27, y + 4.5, rows[i].label, {.size_px = 13, .color = hex(0xFFFFFF)});
  }
}

Rgb lamp_color(LightState state) {
  return state == LightState::off || state == LightState::unknown ? hex(0x4A4F57) : light_color(state);
}

// Paints a halo around the agent and a line along its waypoints. The next waypoint is the largest.
void paint_highlight(Canvas& canvas, const Vector2d& position, double length_px,
                     const std::vector<Vector2d>& waypoints) {
  cairo_t* const context = canvas.context();
  const double dashes[] = {6, 5};
  cairo_set_dash(context, dashes, 2, 0);
  cairo_set_line_width(context, 2);
  canvas.set_color(kHaloColor, 0.9);
  cairo_move_to(context, position.x(), position.y());
  for (const Vector2d& p : waypoints) cairo_line_to(context, p.x(), p.y());
  cairo_stroke(context);
  cairo_set_dash(context, nullptr, 0, 0);
  for (size_t i = 0; i < waypoints.size(); ++i) {
    cairo_arc(context, waypoints[i].x(), waypoints[i].y(), i == 0 ? 7 : 5, 0, kTwoPi);
    canvas.set_color(kHaloColor);
    cairo_fill_preserve(context);
    canvas.set_color(hex(0x14161A));
    cairo_set_line_width(context, 1.2);
    cairo_stroke(context);
  }
  cairo_arc(context, position.x(), position.y(), std::max(0.75 * length_px, 9.0), 0, kTwoPi);
  canvas.set_color(kHaloColor, 0.28);
  cairo_fill_preserve(context);
  canvas.set_color(kHaloColor);
  cairo_set_line_width(context, 2);
  cairo_stroke(context);
}

void paint_caption(Canvas& canvas, const std::string& caption) {
  const TextStyle style{.size_px = 15, .bold = true, .color = hex(0xFFFFFF)};
  canvas.round_rectangle_path(10, 10, canvas.text_width(caption, style) + 22, 28, 6);
  canvas.set_color(hex(0x14161A), 0.72);
  cairo_fill(canvas.context());
  canvas.text(21, 29.5, caption, style);
}

}  // namespace

struct WorldPainter::Impl {
  Impl(const RoadMap& road_map, int width, int height, std::vector<WallFace> wall_faces, const Scenario* recorded)
      : map(road_map),
        layers(road_map),
        walls(std::move(wall_faces)),
        scenario(recorded),
        bounds(bounds_of(road_map)),
        width_px(width),
        height_px(height) {}

  const Canvas& tile(int column, int row, float px_per_m) {
    const auto found = tiles.find({column, row});
    if (found != tiles.end()) return found->second;
    Canvas canvas(kTile_px, kTile_px, kGroundColor);
    const Vector2d left_top = left_top_of({column * kTile_px, row * kTile_px}, px_per_m);
    layers.paint(canvas, left_top, px_per_m);
    {
      GroundPen pen(canvas, left_top, px_per_m);
      for (const WallFace& wall : walls) paint_wall(pen, wall);
    }
    if (scenario) paint_paths(*scenario, canvas, left_top, px_per_m);
    cairo_surface_flush(canvas.surface());
    return tiles.emplace(std::pair{column, row}, std::move(canvas)).first->second;
  }

  void paint_ground(Canvas& canvas, Corner corner, float px_per_m) {
    if (px_per_m != tiles_px_per_m || tiles.size() > kMaxTiles) tiles.clear();
    tiles_px_per_m = px_per_m;
    cairo_t* context = canvas.context();
    cairo_save(context);
    cairo_set_operator(context, CAIRO_OPERATOR_SOURCE);
    for (int row = floor_div(corner.y, kTile_px); row * kTile_px < corner.y + height_px; ++row) {
      for (int column = floor_div(corner.x, kTile_px); column * kTile_px < corner.x + width_px; ++column) {
        const int x = column * kTile_px - corner.x, y = row * kTile_px - corner.y;
        cairo_set_source_surface(context, tile(column, row, px_per_m).surface(), x, y);
        cairo_pattern_set_filter(cairo_get_source(context), CAIRO_FILTER_NEAREST);
        cairo_rectangle(context, x, y, kTile_px, kTile_px);
        cairo_fill(context);
      }
    }
    cairo_restore(context);
  }

  const RoadMap& map;
  MapLayers layers;
  std::vector<WallFace> walls;
  const Scenario* scenario;
  Aabb2 bounds;
  int width_px, height_px;
  float tiles_px_per_m = 0;
  std::map<std::pair<int, int>, Canvas> tiles;
};

WorldPainter::WorldPainter(const RoadMap& map, int width_px, int height_px, std::vector<WallFace> walls,
                           const Scenario* scenario) {
  PICTURA_CHECK(width_px >= 16 && width_px <= 8192 && height_px >= 16 && height_px <= 8192,
                "picture of a world: expected sides of 16 to 8192 px, got {}x{}", width_px, height_px);
  impl_ = std::make_unique<Impl>(map, width_px, height_px, std::move(walls), scenario);
}

WorldPainter::~WorldPainter() = default;

int WorldPainter::width_px() const { return impl_->width_px; }
int WorldPainter::height_px() const { return impl_->height_px; }

TopCamera WorldPainter::whole_map() const {
  constexpr float kMargin_m = 6;
  const Aabb2& box = impl_->bounds;
  const Vec2 size = box.high - box.low;
  return {(box.low + box.high) * 0.5f, min_of(static_cast<float>(impl_->width_px) / (size.x + 2 * kMargin_m),
                                              static_cast<float>(impl_->height_px) / (size.y + 2 * kMargin_m))};
}

TopCamera WorldPainter::around(Vec2 center_m, float width_m) const {
  PICTURA_CHECK(width_m >= 1 && width_m <= 1e5f, "picture of a world: expected a width of 1 to 100000 m, got {}",
                width_m);
  return {center_m, static_cast<float>(impl_->width_px) / width_m};
}

Vec2 WorldPainter::pixel_of(const TopCamera& camera, Vec2 position_m) const {
  const Corner corner = corner_of(camera, impl_->width_px, impl_->height_px);
  return rounded(to_pixels(left_top_of(corner, camera.px_per_m), camera.px_per_m) * in_plan(position_m));
}

RgbImage WorldPainter::draw(const WorldFrame& frame, const TopCamera& camera) {
  PICTURA_CHECK(frame.status.empty() || frame.status.size() == frame.agents.size(),
                "picture of a world: expected the status of {} agents, got {}", frame.agents.size(),
                frame.status.size());
  PICTURA_CHECK(frame.lights.empty() || frame.lights.size() == impl_->map.lights.size(),
                "picture of a world: expected the states of {} lights, got {}", impl_->map.lights.size(),
                frame.lights.size());
  PICTURA_CHECK(frame.heads.empty() || frame.heads.size() == impl_->map.lights.size(),
                "picture of a world: expected the heads of {} lights, got {}", impl_->map.lights.size(),
                frame.heads.size());
  PICTURA_CHECK(frame.halt_reason.empty() || (frame.halt_reason.size() == frame.agents.size() && !frame.status.empty()),
                "picture of a world: expected status and halt reason of {} agents, got {} and {}", frame.agents.size(),
                frame.status.size(), frame.halt_reason.size());
  PICTURA_CHECK(frame.recorded_step < (impl_->scenario ? impl_->scenario->num_steps : 0),
                "picture of a world: expected a recorded step below {}, got {}",
                impl_->scenario ? impl_->scenario->num_steps : 0, frame.recorded_step);
  Canvas canvas(impl_->width_px, impl_->height_px, kGroundColor);
  const Corner corner = corner_of(camera, impl_->width_px, impl_->height_px);
  impl_->paint_ground(canvas, corner, camera.px_per_m);
  const Vector2d left_top = left_top_of(corner, camera.px_per_m);
  const Eigen::Affine2d map_to_pixels = to_pixels(left_top, camera.px_per_m);
  const auto pixel_at = [&](auto position_m) -> Vector2d { return map_to_pixels * in_plan(position_m); };
  for (size_t i = 0; i < frame.lights.size(); ++i) {
    TrafficLight light = impl_->map.lights[i];
    if (!frame.heads.empty()) light.head_m = frame.heads[i].position_m;
    paint_light(canvas, light, left_top, camera.px_per_m, lamp_color(frame.lights[i]));
  }

  if (frame.recorded_step >= 0) {
    paint_boxes(*impl_->scenario, frame.recorded_step, canvas, left_top, camera.px_per_m);
  }
  for (const AgentGoal& goal : frame.goals) {
    const AgentBox& agent = frame.agents[goal.agent];
    paint_goal(canvas, pixel_at(agent.center_m), pixel_at(goal.position_m), agent.agent_class);
  }

  const auto status_of = [&frame](size_t i) { return frame.status.empty() ? AgentStatus::active : frame.status[i]; };
  const auto is_shown = [&](size_t i) { return frame.agents[i].drawn && has_body(status_of(i)); };
  const bool has_highlight = frame.highlighted >= 0 && static_cast<size_t>(frame.highlighted) < frame.agents.size();
  if (has_highlight && is_shown(static_cast<size_t>(frame.highlighted))) {
    const AgentBox& agent = frame.agents[frame.highlighted];
    std::vector<Vector2d> waypoints;
    for (const Vec2 waypoint : frame.waypoints_m) waypoints.push_back(pixel_at(waypoint));
    paint_highlight(canvas, pixel_at(agent.center_m), double{agent.length_m} * camera.px_per_m, waypoints);
  }

  for (size_t i = 0; i < frame.agents.size(); ++i) {
    if (!is_shown(i)) continue;
    const AgentStatus status = status_of(i);
    const Vector2d position = pixel_at(frame.agents[i].center_m);
    paint_agent(canvas, frame.agents[i], status, position, camera.px_per_m);
    const HaltReason* reason =
        status != AgentStatus::halted || frame.halt_reason.empty() ? nullptr : reason_of(frame.halt_reason[i]);
    if (reason) paint_halt(canvas, *reason, position, frame.agents[i].length_m * camera.px_per_m);
  }

  for (const WorldMark& mark : frame.marks) paint_mark(canvas, mark, pixel_at(mark.position_m));
  if (!frame.halt_reason.empty()) paint_legend(canvas, frame);
  if (!frame.caption.empty()) paint_caption(canvas, frame.caption);
  return canvas.image();
}

RgbImage draw_world(WorldPainter& painter, Simulator& simulator, int world, int followed, float follow_width_m,
                    const std::string& caption) {
  const auto num_worlds = static_cast<int>(simulator.worlds().size());
  PICTURA_CHECK(world >= 0 && world < num_worlds, "picture of a world: expected a world in [0, {}), got {}", num_worlds,
                world);
  PICTURA_CHECK(simulator.device().is_host(), "picture of a world: expected a simulator in host memory, got {}",
                simulator.name());
  size_t first_slot = 0;
  for (int w = 0; w < world; ++w) first_slot += static_cast<size_t>(simulator.worlds()[w].num_agents);
  const auto num_slots = static_cast<size_t>(simulator.worlds()[world].num_agents);
  PICTURA_CHECK(followed < static_cast<int>(num_slots), "picture of a world: expected an agent below {}, got {}",
                num_slots, followed);
  const SceneBatch& scene = simulator.scene();
  const AgentStateView state = simulator.state();
  const auto range = [world](auto begin, auto all) {
    const auto first = static_cast<size_t>(begin[world]);
    return all.subspan(first, static_cast<size_t>(begin[static_cast<size_t>(world) + 1]) - first);
  };
  WorldFrame frame;
  frame.agents = range(scene.world_begin, scene.agents);
  frame.lights = range(scene.light_begin, scene.light_states);
  const int map = simulator.worlds()[world].map;
  frame.heads = simulator.maps()[map]->geometry.heads;
  std::vector<AgentStatus> status(frame.agents.size(), AgentStatus::parked);
  std::copy_n(state.status + first_slot, std::min(num_slots, status.size()), status.begin());
  frame.status = status;
  std::vector<uint8_t> halt_reason(frame.agents.size(), 0);
  std::copy_n(state.halt_reason + first_slot, std::min(num_slots, halt_reason.size()), halt_reason.begin());
  frame.halt_reason = halt_reason;
  std::vector<AgentGoal> goals;
  for (size_t agent = 0; agent < num_slots; ++agent) {
    if (status[agent] != AgentStatus::active) continue;
    const size_t at =
        (first_slot + agent) * kNumWaypoints + static_cast<size_t>(state.next_waypoint[first_slot + agent]);
    goals.push_back({static_cast<int>(agent), {state.waypoint_x_m[at], state.waypoint_y_m[at]}});
  }
  frame.goals = goals;
  frame.highlighted = followed;
  frame.caption = caption;
  std::vector<Vec2> waypoints;
  TopCamera camera = painter.whole_map();
  if (followed >= 0 && has_body(status[followed])) {
    const size_t slot = first_slot + static_cast<size_t>(followed);
    for (int i = std::max(0, state.next_waypoint[slot]); i < kNumWaypoints; ++i) {
      const size_t at = slot * kNumWaypoints + static_cast<size_t>(i);
      waypoints.push_back({state.waypoint_x_m[at], state.waypoint_y_m[at]});
    }
    if (follow_width_m > 0) camera = painter.around(frame.agents[followed].center_m.xy(), follow_width_m);
  }
  frame.waypoints_m = waypoints;
  return painter.draw(frame, camera);
}

}  // namespace pictura
