// Replay of one world. Values are whole numbers of units such as 1 cm, so that files are lossless. A frame is a state;
// a step leads to the next frame. docs/reference/replay.md describes the file.
#pragma once

#include <array>
#include <cstdint>
#include <optional>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/color.h"
#include "pictura/common/scene_types.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/reward_terms.h"

namespace pictura {

/// Maximum number of track values, which take 256 MiB.
constexpr int64_t kMaxReplayNumbers = int64_t{1} << 26;

/// Only version of the file format that readers accept.
constexpr int kReplayVersion = 2;

// List of tracks (quantities by frame and agent): X(name, unit, order). A track stores whole numbers of `unit`, as
// differences of this order between frames. Values of a step belong to the frame after it, and are 0 at an episode's
// first frame.
#define PICTURA_REPLAY_STATE_TRACKS(X) \
  X(x_m, 0.01, 2)                      \
  X(y_m, 0.01, 2)                      \
  X(z_m, 0.01, 1)                      \
  X(heading_deg, 0.1, 2)               \
  X(speed_mps, 0.01, 1)                \
  X(steer_deg, 0.1, 1)                 \
  X(status, 1, 1)                      \
  X(halt_reason, 1, 1)                 \
  X(next_waypoint, 1, 1)               \
  X(events, 1, 0)                      \
  X(action, 1, 0)

/// Positions are of the box's centre. Headings do not jump by 360 degrees within an episode. status: AgentStatus.
/// events: Event bits. action: 1 + the action's index, or 0 without a chosen action.
enum class Track : int32_t {
#define X(name, unit, order) name,
  PICTURA_REPLAY_STATE_TRACKS(X)
#undef X
#define X(name) reward_##name,
      PICTURA_REWARD_TERMS(X)
#undef X
          count
};
constexpr size_t kNumTracks = static_cast<size_t>(Track::count);

/// Small, because the time penalty of a step is 2.5e-6.
constexpr double kRewardUnit = 1e-7;

struct TrackInfo {
  std::string_view name;
  double unit;
  int order;
};
constexpr std::array<TrackInfo, kNumTracks> kTracks{{
#define X(name, unit, order) {#name, unit, order},
    PICTURA_REPLAY_STATE_TRACKS(X)
#undef X
#define X(name) {"reward_" #name, kRewardUnit, 1},
        PICTURA_REWARD_TERMS(X)
#undef X
}};

struct ReplayBody {
  AgentClass agent_class = AgentClass::vehicle;
  int32_t length_cm = 0, width_cm = 0, height_cm = 0;
  bool operator==(const ReplayBody&) const = default;
};

/// Parked car, or road user that a probe inserts.
struct ReplayBox {
  ReplayBody body;
  int32_t x_cm = 0, y_cm = 0, z_cm = 0, heading_ddeg = 0;  // ddeg: tenths of a degree
  bool operator==(const ReplayBox&) const = default;
};

/// Waypoints of an agent from `frame` on.
struct ReplayChain {
  int32_t frame = 0, agent = 0;
  std::array<int32_t, kNumWaypoints> x_cm{}, y_cm{}, z_cm{};
  bool operator==(const ReplayChain&) const = default;
};

struct ReplayEpisode {
  int32_t index = 0;  // in the simulator
  int32_t first_frame = 0, num_frames = 0;
  std::vector<ReplayBody> agents;   // [agents]
  std::vector<float> conditioning;  // [agents, kNumConditioning]
  std::vector<ReplayBox> parked;
  std::vector<ReplayChain> chains;  // by frame
  bool operator==(const ReplayEpisode&) const = default;
};

enum class ShapeKind : uint8_t {
  lane,           // ring; detail: LaneType
  crosswalk,      // ring
  parking_space,  // ring
  marking,        // line; detail: MarkColor
  stop_line,      // line
  road_edge,      // line
  wall,           // line
  // Both ends of the stop line, the head, and a point one metre in front of the head; lights in the map's order.
  light,
};
constexpr int kNumShapeKinds = 8;
constexpr size_t kLightPoints = 4;

struct ReplayShape {
  ShapeKind kind = ShapeKind::lane;
  int32_t detail = 0, width_cm = 0;
  std::vector<std::array<int32_t, 2>> points_cm;
  bool operator==(const ReplayShape&) const = default;
};

/// Red, green, blue before distance fades them.
using ReplayHue = std::array<uint8_t, 3>;
using ReplayPoint = std::array<int32_t, 3>;  // x, y, z in cm

/// Painted line for images (docs/explanation/image.md), in the order of the map's strips. append_strips() converts it.
struct ReplayLine {
  StripKind kind = StripKind::lane_mark;
  ReplayHue color{};
  int32_t width_mm = 0;
  std::vector<ReplayPoint> points_cm;
  bool operator==(const ReplayLine&) const = default;
};
struct ReplayWall {
  ReplayHue color{};
  int32_t height_cm = 0;
  ReplayPoint a_cm{}, b_cm{};  // ends of the foot
  bool operator==(const ReplayWall&) const = default;
};
struct ReplayHead {
  int32_t signal = 0;  // index in a frame's lights
  int32_t facing_ddeg = 0, half_angle_ddeg = 0;
  ReplayPoint position_cm{};
  bool operator==(const ReplayHead&) const = default;
};
struct ReplayScenery {
  std::vector<ReplayLine> lines;
  std::vector<ReplayWall> walls;
  std::vector<ReplayHead> heads;
  bool operator==(const ReplayScenery&) const = default;
};

/// Values of a policy's decision in units of kDecisionUnit: action probabilities, then the value. All are 0 without a
/// decision.
constexpr size_t kDecisionValues = kNumActions + 1;
constexpr double kDecisionUnit = 1e-4;

/// Camera on an agent, with the members of Camera.
struct ReplayCamera {
  std::string name;
  int32_t width_px = 0, height_px = 0;
  float focal_x_px = 0, focal_y_px = 0, center_x_px = 0, center_y_px = 0;
  float x_m = 0, y_m = 0, z_m = 0, yaw_rad = 0, pitch_rad = 0, roll_rad = 0;
  bool operator==(const ReplayCamera&) const = default;
};

/// Compressed images of the followed agents, from the first frame on. The last group may be smaller.
struct ReplayImages {
  int32_t frames_per_group = 0;
  std::vector<std::string> groups;  // see images.h
  bool operator==(const ReplayImages&) const = default;
};

struct ReplayOrigin {
  std::string command, commit, version;
  std::string map, map_hash;
  // in the map file's coordinates; zero if the replay's file lacks this value
  std::array<double, 3> map_origin_m{};
  std::string policy, policy_hash;
  std::string light_cycles;  // light_cycles_text(); empty in files without this value
  uint64_t seed = 0;
  uint32_t global_world = 0;
  float dt_s = 0.1f;
  bool operator==(const ReplayOrigin&) const = default;
};

/// Events are counted per agent and step.
struct ReplayMetrics {
  int64_t spawned = 0, agent_steps = 0;
  int64_t collisions = 0, at_fault_collisions = 0, off_road = 0, red_light = 0, wall_contacts = 0;
  int64_t goals_reached = 0, waypoints_reached = 0;
  double km_driven = 0, reward = 0;
  bool operator==(const ReplayMetrics&) const = default;
};
// List of metrics: X(name).
#define PICTURA_REPLAY_METRICS(X) \
  X(spawned)                      \
  X(agent_steps)                  \
  X(collisions)                   \
  X(at_fault_collisions)          \
  X(off_road)                     \
  X(red_light)                    \
  X(wall_contacts)                \
  X(goals_reached)                \
  X(waypoints_reached)            \
  X(km_driven)                    \
  X(reward)

/// Policy's value and braking probability in a state with a road user and without it.
struct ReplayResponse {
  std::string policy;
  double value = 0, value_without = 0, brake = 0, brake_without = 0;
  bool operator==(const ReplayResponse&) const = default;
};

/// Probe case: a road user is removed from a frame, or inserted. `ego`: the responding agent.
struct ReplayCase {
  std::string what;  // a sentence
  int32_t frame = 0, ego = 0;
  int32_t removed = -1;                         // agent, or -1
  std::optional<ReplayBox> inserted;            // into `frame`
  std::vector<std::array<int32_t, 2>> path_cm;  // all positions of the inserted user
  std::vector<ReplayResponse> answers;          // by policy
  bool operator==(const ReplayCase&) const = default;
};

/// Moment that galleries show first; frame -1: none.
struct ReplayMoment {
  int32_t frame = -1, agent = 0;
  bool operator==(const ReplayMoment&) const = default;
};

struct Replay {
  ReplayOrigin origin;
  ReplayMetrics metrics;
  ReplayMoment first_infraction;
  std::optional<ReplayCase> probed;
  int32_t num_agents = 0, num_frames = 0, num_lights = 0;
  int32_t followed = -1;  // agent with decisions and images in the first frame; -1: none
  // [frames] agent with decisions and images; empty: `followed`
  std::vector<int32_t> followed_agents;
  std::vector<ReplayShape> map;
  ReplayScenery scenery;
  std::vector<ReplayCamera> cameras;  // cameras of every agent
  float line_floor_px = 0;            // minimum line width
  std::vector<ReplayEpisode> episodes;
  std::array<std::vector<int32_t>, kNumTracks> tracks;  // [frames, agents]
  std::vector<uint8_t> lights;                          // [frames, lights] LightState
  std::vector<int32_t> decisions;                       // [frames, kDecisionValues], or empty
  ReplayImages images;                                  // groups are empty without images
  bool operator==(const Replay&) const = default;

  int32_t at(Track track, int frame, int agent) const {
    return tracks[static_cast<size_t>(track)]
                 [static_cast<size_t>(frame) * static_cast<size_t>(num_agents) + static_cast<size_t>(agent)];
  }
  /// Returns the agent with decisions and images in a frame, or -1.
  int32_t followed_at(int frame) const { return followed_agents.empty() ? followed : followed_agents[frame]; }
  /// Returns the number of leading frames with images.
  int num_pictured_frames() const {
    const auto kept = static_cast<int64_t>(images.groups.size()) * images.frames_per_group;
    return static_cast<int>(kept < num_frames ? kept : num_frames);
  }
};

}  // namespace pictura
