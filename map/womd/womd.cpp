#include "pictura/map/womd/womd.h"

#include <algorithm>
#include <cmath>
#include <map>

#include <fmt/format.h>

#include "pictura/map/womd/wire.h"

namespace pictura::womd {

namespace {

constexpr double kMphToMps = 0.44704;
constexpr std::size_t kMaxItems = 4'000'000;         // points, states and signals; a large scene has 100,000
constexpr std::size_t kMaxSignalStates = 8'000'000;  // signals x steps

/// Decodes the messages of one record, and bounds their number.
class Decoder {
 public:
  explicit Decoder(LoggedScene* scene) : scene_(*scene) {}

  void decode(std::string_view payload) {
    WireReader fields(payload);
    while (fields.next()) {
      switch (fields.field()) {
        case 1:
          within("timestamps_seconds", [&] { fields.numbers64([&](double value) { add_timestamp(value); }); });
          break;
        case 2: within("tracks", scene_.tracks.size(), [&] { decode_track(fields.bytes()); }); break;
        case 4:
          within("objects_of_interest", [&] {
            fields.integers([&](int64_t id) {
              count_item();
              scene_.objects_of_interest.push_back(id);
            });
          });
          break;
        case 5: within("scenario_id", [&] { scene_.id = checked_id(fields.bytes()); }); break;
        case 6: within("sdc_track_index", [&] { sdc_index_ = fields.integer32(); }); break;
        case 7: within("dynamic_map_states", num_signal_steps_, [&] { decode_signals(fields.bytes()); }); break;
        case 8: within("map_features", num_features_++, [&] { decode_feature(fields.bytes()); }); break;
        case 10: within("current_time_index", [&] { scene_.current_step = fields.integer32(); }); break;
        case 11:
          within("tracks_to_predict", scene_.predictions.size(), [&] { decode_prediction(fields.bytes()); });
          break;
        default: break;  // lidar data, camera tokens, and fields of later versions
      }
    }
    finish();
  }

  /// Returns a scenario_id, which may be any printable text of limited length.
  static std::string checked_id(std::string_view bytes) {
    constexpr std::size_t kMaxId = 256;
    if (bytes.size() > kMaxId) fail_field("", "expected at most {} bytes, got {}", kMaxId, bytes.size());
    for (const char letter : bytes) {
      if (letter < ' ' || letter > '~') fail_field("", "expected printable letters, got byte {}", int{letter});
    }
    return std::string(bytes);
  }

 private:
  void count_item() {
    if (++num_items_ > kMaxItems)
      fail_field("", "expected at most {} points and states in a scene, got more", kMaxItems);
  }

  void add_timestamp(double value) {
    if (timestamps_.size() >= static_cast<std::size_t>(kMaxScenarioSteps)) {
      fail_field("", "expected at most {} steps, got more", kMaxScenarioSteps);
    }
    timestamps_.push_back(checked_number("", value, 1e12));
  }

  void decode_track(std::string_view bytes) {
    LoggedTrack& track = scene_.tracks.emplace_back();
    if (scene_.tracks.size() > static_cast<std::size_t>(kMaxScenarioTracks)) {
      fail_field("", "expected at most {} tracks, got more", kMaxScenarioTracks);
    }
    WireReader fields(bytes);
    while (fields.next()) {
      switch (fields.field()) {
        case 1: track.id = within("id", [&] { return fields.integer32(); }); break;
        case 2:
          within("object_type", [&] {
            const int64_t type = fields.integer();
            if (type < 0 || type > 4) fail_field("", "expected a type of 0 to 4, got {}", type);
            track.type = static_cast<TrackType>(type);
          });
          break;
        case 3: within("states", track.states.size(), [&] { decode_state(fields.bytes(), &track); }); break;
        default: break;
      }
    }
  }

  void decode_state(std::string_view bytes, LoggedTrack* track) {
    count_item();
    LoggedState& state = track->states.emplace_back();
    WireReader fields(bytes);
    while (fields.next()) {
      switch (fields.field()) {
        case 2: state.center_m.x() = within("center_x", [&] { return fields.number64(); }); break;
        case 3: state.center_m.y() = within("center_y", [&] { return fields.number64(); }); break;
        case 4: state.center_m.z() = within("center_z", [&] { return fields.number64(); }); break;
        case 5: state.length_m = double{within("length", [&] { return fields.number32(); })}; break;
        case 6: state.width_m = double{within("width", [&] { return fields.number32(); })}; break;
        case 7: state.height_m = double{within("height", [&] { return fields.number32(); })}; break;
        case 8: state.heading_rad = double{within("heading", [&] { return fields.number32(); })}; break;
        case 9: state.velocity_x_mps = double{within("velocity_x", [&] { return fields.number32(); })}; break;
        case 10: state.velocity_y_mps = double{within("velocity_y", [&] { return fields.number32(); })}; break;
        case 11: state.valid = within("valid", [&] { return fields.boolean(); }); break;
        default: break;
      }
    }
    if (!state.valid) return;  // an invalid state may contain remains of an estimate
    checked_number("center_x", state.center_m.x());
    checked_number("center_y", state.center_m.y());
    checked_number("center_z", state.center_m.z());
    checked_number("length", state.length_m);
    checked_number("width", state.width_m);
    checked_number("height", state.height_m);
    checked_number("heading", state.heading_rad);
    checked_number("velocity_x", state.velocity_x_mps);
    checked_number("velocity_y", state.velocity_y_mps);
  }

  void decode_prediction(std::string_view bytes) {
    count_item();
    std::pair<int32_t, int32_t> prediction{0, 0};
    WireReader fields(bytes);
    while (fields.next()) {
      if (fields.field() == 1) prediction.first = within("track_index", [&] { return fields.integer32(); });
      if (fields.field() == 2) prediction.second = within("difficulty", [&] { return fields.integer32(); });
    }
    scene_.predictions.push_back(prediction);
  }

  void decode_signals(std::string_view bytes) {
    if (num_signal_steps_ >= static_cast<std::size_t>(kMaxScenarioSteps)) {
      fail_field("", "expected at most {} steps, got more", kMaxScenarioSteps);
    }
    WireReader fields(bytes);
    std::size_t count = 0;
    while (fields.next()) {
      if (fields.field() == 1) within("lane_states", count++, [&] { decode_signal(fields.bytes()); });
    }
    ++num_signal_steps_;
  }

  void decode_signal(std::string_view bytes) {
    count_item();
    int64_t lane = 0;
    auto state = RecordedLightState::none;
    WireReader fields(bytes);
    while (fields.next()) {
      if (fields.field() == 1) lane = within("lane", [&] { return fields.integer(); });
      if (fields.field() == 2) {
        within("state", [&] {
          const int64_t number = fields.integer();
          if (number < 0 || number > 8) fail_field("", "expected a state of 0 to 8, got {}", number);
          state = static_cast<RecordedLightState>(number);
        });
      }
      // The stop point is only checked: the importer uses the start of the lane (docs/reference/scenario.md).
      if (fields.field() == 3) within("stop_point", [&] { decode_point(fields.bytes()); });
    }
    signals_[lane].emplace_back(static_cast<int32_t>(num_signal_steps_), state);
  }

  Eigen::Vector3d decode_point(std::string_view bytes) {
    count_item();
    Eigen::Vector3d point(0, 0, 0);
    WireReader fields(bytes);
    while (fields.next()) {
      switch (fields.field()) {
        case 1: point.x() = within("x", [&] { return checked_number("", fields.number64()); }); break;
        case 2: point.y() = within("y", [&] { return checked_number("", fields.number64()); }); break;
        case 3: point.z() = within("z", [&] { return checked_number("", fields.number64()); }); break;
        default: break;
      }
    }
    return point;
  }

  void decode_feature(std::string_view bytes) {
    // The id may follow the part to which it belongs. If there are several parts, the last counts.
    int64_t id = 0;
    uint32_t kind = 0;
    std::string_view part;
    WireReader fields(bytes);
    while (fields.next()) {
      switch (fields.field()) {
        case 1: id = within("id", [&] { return fields.integer(); }); break;
        case 3:
        case 4:
        case 5:
        case 7:
        case 8:
        case 9:
        case 10:
          kind = fields.field();
          part = fields.bytes();
          break;
        default: break;
      }
    }
    count_item();
    switch (kind) {
      case 3: within("lane", [&] { decode_lane(part, id); }); break;
      case 4: within("road_line", [&] { decode_line(part, id); }); break;
      case 5: within("road_edge", [&] { decode_edge(part, id); }); break;
      case 7: within("stop_sign", [&] { decode_stop_sign(part, id); }); break;
      case 8: within("crosswalk", [&] { decode_crosswalk(part, id); }); break;
      case 9: scene_.note("speed bumps, which maps do not have, left out", fmt::format("feature {}", id)); break;
      case 10: scene_.note("driveways, which maps do not have, left out", fmt::format("feature {}", id)); break;
      default: scene_.note("map features of no known kind left out", fmt::format("feature {}", id));
    }
  }

  void decode_lane(std::string_view bytes, int64_t id) {
    LoggedLane& lane = scene_.lanes.emplace_back();
    lane.id = id;
    WireReader fields(bytes);
    const auto add_id = [&](std::vector<int64_t>* ids) {
      return [this, ids](int64_t other) {
        count_item();
        ids->push_back(other);
      };
    };
    while (fields.next()) {
      switch (fields.field()) {
        case 1:
          within("speed_limit_mph", [&] {
            const double limit_mph = checked_number("", fields.number64(), 1000);
            if (limit_mph < 0) fail_field("", "expected 0 or more, got {}", limit_mph);
            lane.speed_limit_mps = limit_mph * kMphToMps;
          });
          break;
        case 2:
          within("type", [&] {
            const int64_t type = fields.integer();
            if (type < 0 || type > 3) fail_field("", "expected a type of 0 to 3, got {}", type);
            lane.type = static_cast<LoggedLaneType>(type);
          });
          break;
        case 3: lane.interpolating = within("interpolating", [&] { return fields.boolean(); }); break;
        case 8: add_point("polyline", fields.bytes(), &lane.points); break;
        case 9: within("entry_lanes", [&] { fields.integers(add_id(&lane.entries)); }); break;
        case 10: within("exit_lanes", [&] { fields.integers(add_id(&lane.exits)); }); break;
        case 11: decode_neighbor("left_neighbors", fields.bytes(), &lane.left_neighbors); break;
        case 12: decode_neighbor("right_neighbors", fields.bytes(), &lane.right_neighbors); break;
        case 13: decode_boundary("left_boundaries", fields.bytes(), &lane.left_boundaries); break;
        case 14: decode_boundary("right_boundaries", fields.bytes(), &lane.right_boundaries); break;
        default: break;
      }
    }
  }

  void add_point(const char* name, std::string_view bytes, LoggedPoints* points) {
    within(name, points->size(), [&] { points->push_back(decode_point(bytes)); });
  }

  void decode_neighbor(const char* name, std::string_view bytes, std::vector<LoggedNeighbor>* neighbors) {
    within(name, neighbors->size(), [&] {
      count_item();
      LoggedNeighbor neighbor;
      WireReader fields(bytes);
      while (fields.next()) {
        if (fields.field() == 1) neighbor.lane = fields.integer();
        if (fields.field() == 2) neighbor.begin = fields.integer32();
        if (fields.field() == 3) neighbor.end = fields.integer32();
      }
      neighbors->push_back(neighbor);
    });
  }

  void decode_boundary(const char* name, std::string_view bytes, std::vector<LoggedBoundary>* boundaries) {
    within(name, boundaries->size(), [&] {
      count_item();
      LoggedBoundary boundary;
      WireReader fields(bytes);
      while (fields.next()) {
        if (fields.field() == 1) boundary.begin = fields.integer32();
        if (fields.field() == 2) boundary.end = fields.integer32();
        if (fields.field() == 3) boundary.feature = fields.integer();
      }
      boundaries->push_back(boundary);
    });
  }

  void decode_line(std::string_view bytes, int64_t id) {
    LoggedLine& line = scene_.lines.emplace_back();
    line.id = id;
    WireReader fields(bytes);
    while (fields.next()) {
      if (fields.field() == 1) {
        within("type", [&] {
          const int64_t type = fields.integer();
          if (type < 0 || type > 8) fail_field("", "expected a type of 0 to 8, got {}", type);
          line.type = static_cast<LoggedLineType>(type);
        });
      }
      if (fields.field() == 2) add_point("polyline", fields.bytes(), &line.points);
    }
  }

  void decode_edge(std::string_view bytes, int64_t id) {
    LoggedEdge& edge = scene_.edges.emplace_back();
    edge.id = id;
    WireReader fields(bytes);
    while (fields.next()) {
      if (fields.field() == 2) add_point("polyline", fields.bytes(), &edge.points);
    }
  }

  void decode_stop_sign(std::string_view bytes, int64_t id) {
    LoggedStopSign& sign = scene_.stop_signs.emplace_back();
    sign.id = id;
    WireReader fields(bytes);
    while (fields.next()) {
      if (fields.field() == 1) {
        within("lane", [&] {
          fields.integers([&](int64_t lane) {
            count_item();
            sign.lanes.push_back(lane);
          });
        });
      }
      if (fields.field() == 2) sign.position_m = within("position", [&] { return decode_point(fields.bytes()); });
    }
  }

  void decode_crosswalk(std::string_view bytes, int64_t id) {
    LoggedPolygon& polygon = scene_.crosswalks.emplace_back();
    polygon.id = id;
    WireReader fields(bytes);
    while (fields.next()) {
      if (fields.field() == 1) add_point("polygon", fields.bytes(), &polygon.points);
    }
  }

  /// Checks and sets values that depend on several fields.
  void finish() {
    if (timestamps_.empty()) fail_field("timestamps_seconds", "expected at least one, got none");
    scene_.num_steps = static_cast<int32_t>(timestamps_.size());
    if (timestamps_.size() > 1) {
      const auto intervals = static_cast<double>(timestamps_.size() - 1);
      scene_.dt_s = (timestamps_.back() - timestamps_.front()) / intervals;
      if (!(scene_.dt_s > 1e-3 && scene_.dt_s < 10)) {
        fail_field("timestamps_seconds", "expected steps of more than 0.001 s and less than 10 s, got a mean of {:g} s",
                   scene_.dt_s);
      }
      for (std::size_t i = 1; i < timestamps_.size(); ++i) {
        if (!(timestamps_[i] > timestamps_[i - 1])) {
          within("timestamps_seconds", i,
                 [&] { fail_field("", "expected more than {}, got {}", timestamps_[i - 1], timestamps_[i]); });
        }
      }
    }
    const auto steps = static_cast<std::size_t>(scene_.num_steps);
    for (std::size_t i = 0; i < scene_.tracks.size(); ++i) {
      if (scene_.tracks[i].states.size() == steps) continue;
      within("tracks", i, [&] {
        fail_field("states", "expected one for each of the {} timestamps, got {}", steps,
                   scene_.tracks[i].states.size());
      });
    }
    if (scene_.current_step < 0 || scene_.current_step >= scene_.num_steps) {
      fail_field("current_time_index", "expected a step in [0, {}), got {}", steps, scene_.current_step);
    }
    if (sdc_index_ < 0 || sdc_index_ >= static_cast<int64_t>(scene_.tracks.size())) {
      fail_field("sdc_track_index", "expected an index in [0, {}), got {}", scene_.tracks.size(), sdc_index_);
    }
    scene_.sdc_track = sdc_index_;
    if (num_signal_steps_ != 0 && num_signal_steps_ != steps) {
      fail_field("dynamic_map_states", "expected one for each of the {} timestamps, got {}", steps, num_signal_steps_);
    }
    if (signals_.size() * steps > kMaxSignalStates) {
      fail_field("dynamic_map_states", "expected at most {} signals at {} steps, got {}", kMaxSignalStates / steps,
                 steps, signals_.size());
    }
    for (const auto& [lane, states] : signals_) {
      LoggedLight& light = scene_.lights.emplace_back();
      light.lanes = {lane};
      light.states.assign(steps, RecordedLightState::none);
      for (const auto& [step, state] : states) light.states[step] = state;
    }
  }

  LoggedScene& scene_;
  std::vector<double> timestamps_;
  std::map<int64_t, std::vector<std::pair<int32_t, RecordedLightState>>> signals_;  // by lane
  std::size_t num_signal_steps_ = 0, num_features_ = 0, num_items_ = 0;
  int32_t sdc_index_ = 0;
};

/// Returns the scenario_id of a record for messages, or an empty string if none is found. Other fields of the record
/// may be faulty.
std::string id_in(std::string_view payload) {
  std::string id;
  try {
    WireReader fields(payload);
    while (fields.next()) {
      if (fields.field() == 5) id = Decoder::checked_id(fields.bytes());
    }
  } catch (const FieldError&) {
    // The caller already knows the fault that ends the message early.
  }
  return id;
}

}  // namespace

LoggedScene parse_scenario(std::string_view payload, const std::string& source) {
  LoggedScene scene;
  scene.format = "womd";
  const auto full_source = [&] {
    const std::string id = scene.id.empty() ? id_in(payload) : scene.id;
    return id.empty() ? source : fmt::format("{} (scenario {})", source, id);
  };
  try {
    Decoder(&scene).decode(payload);
  } catch (const FieldError& error) {
    throw to_error(full_source(), error);
  }
  scene.source = full_source();
  scene.name = scene.id.empty() ? "womd" : scene.id;
  return scene;
}

std::string scan_scenario_id(const ByteSource& source, RecordPlace place) {
  constexpr std::size_t kTag_bytes = 20;  // a tag and a length, or a varint
  constexpr uint32_t kScenarioId = 5;
  constexpr uint64_t kMaxId = 256;
  std::string id;
  const uint64_t end = place.offset + place.bytes;
  for (uint64_t at = place.offset; at < end;) {
    const std::string head = source.read(at, static_cast<std::size_t>(std::min<uint64_t>(kTag_bytes, end - at)));
    WireReader field(head);
    const auto [head_bytes, value_bytes] = field.next_extent();
    if (value_bytes > end - at - head_bytes) {
      fail_field("", "field {}: expected at most the {} remaining bytes of the record, got {}", field.field(),
                 end - at - head_bytes, value_bytes);
    }
    if (field.field() == kScenarioId && field.type() == WireType::bytes && value_bytes <= kMaxId) {
      id = source.read(at + head_bytes, static_cast<std::size_t>(value_bytes));
    }
    at += head_bytes + value_bytes;
  }
  return id;
}

}  // namespace pictura::womd
