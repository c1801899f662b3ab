#include "pictura/drawing/tracks.h"

#include "pictura/drawing/plan.h"

namespace pictura {

namespace {

constexpr double kWay_m = 0.25, kMinWay_px = 1.2, kMinOutline_px = 0.6;

void paint_box(GroundPen& pen, const RecordedTrack& track, const TrackState& state, Rgb color) {
  const Eigen::Isometry2d pose = pose_in_plan(in_plan(state.position_m), state.heading_rad);
  const double front = 0.5 * track.length_m, side = 0.5 * track.width_m;
  const auto at = [&pose](double ahead_m, double left_m) -> Eigen::Vector2d {
    return pose * Eigen::Vector2d(ahead_m, left_m);
  };
  pen.move_to(at(front, side));
  pen.line_to(at(-front, side));
  pen.line_to(at(-front, -side));
  pen.line_to(at(front, -side));
  cairo_close_path(pen.context());
  pen.canvas().set_color(color, 0.85);
  cairo_fill_preserve(pen.context());
  pen.canvas().set_color(hex(0x22262B));
  cairo_set_line_width(pen.context(), pen.at_least(0.05, kMinOutline_px));
  cairo_stroke(pen.context());
  // A white line marks the front.
  pen.line(at(0.5 * front, 0), at(front, 0), pen.at_least(0.1, kMinOutline_px), hex(0xFFFFFF));
}

Rgb color_of(const Scenario& scenario, std::size_t track) {
  return static_cast<int32_t>(track) == scenario.sdc_track ? kSdcInk : track_color(scenario.tracks[track].type);
}

}  // namespace

Rgb track_color(TrackType type) {
  switch (type) {
    case TrackType::vehicle: return hex(0x2F6FDE);
    case TrackType::pedestrian: return hex(0xD9480F);
    case TrackType::cyclist: return hex(0x9C36B5);
    case TrackType::unset:
    case TrackType::other: break;
  }
  return kUnknownTrackInk;
}

void paint_paths(const Scenario& scenario, Canvas& canvas, const Eigen::Vector2d& left_top_m, double px_per_m) {
  GroundPen pen(canvas, left_top_m, px_per_m);
  for (std::size_t i = 0; i < scenario.tracks.size(); ++i) {
    const Span<const TrackState> states = scenario.states_of(static_cast<int32_t>(i));
    const Span<const uint8_t> valid = scenario.valid_of(static_cast<int32_t>(i));
    for (std::size_t step = 0; step < states.size(); ++step) {
      if (!valid[step]) continue;
      const bool goes_on = step > 0 && valid[step - 1];
      const Eigen::Vector2d position = in_plan(states[step].position_m);
      goes_on ? pen.line_to(position) : pen.move_to(position);
    }
    canvas.set_color(color_of(scenario, i), 0.8);
    cairo_set_line_width(pen.context(), pen.at_least(kWay_m, kMinWay_px));
    cairo_stroke(pen.context());
  }
  for (const RecordedLight& light : scenario.lights) {
    pen.line(in_plan(light.stop_a_m), in_plan(light.stop_b_m), pen.at_least(0.4, 1.5), kStopLineInk);
  }
}

void paint_boxes(const Scenario& scenario, int32_t step, Canvas& canvas, const Eigen::Vector2d& left_top_m,
                 double px_per_m) {
  GroundPen pen(canvas, left_top_m, px_per_m);
  for (std::size_t i = 0; i < scenario.tracks.size(); ++i) {
    const auto index = static_cast<int32_t>(i);
    const auto at = static_cast<std::size_t>(step);
    if (!scenario.valid_of(index)[at]) continue;
    paint_box(pen, scenario.tracks[i], scenario.states_of(index)[at], color_of(scenario, i));
  }
}

}  // namespace pictura
