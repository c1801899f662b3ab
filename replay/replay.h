// Replay of one world over many steps. Values are whole numbers of units (such as 1 cm or 0.1 degree), so that files
// store them without loss. A frame is a state, and a step leads from each frame to the next. docs/reference/replay.md
// describes the file.
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

/// Maximum number of values in all tracks of a replay: enough for 120 agents and 24,000 steps, in 256 MB.
constexpr int64_t kMaxReplayNumbers = int64_t{1} << 26;

/// Version of the file format. Readers accept no other version.
constexpr int kReplayVersion = 2;

// List of the tracks, which are quantities of every agent at every frame: X(name, unit, order). A track stores whole
// numbers of `unit`, as differences of order `order` between frames. Values of a step belong to the frame after the
// step. They are 0 at the first frame of an episode.
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

/// Tracks. Positions are of the box's centre. Within an episode, headings do not jump by 360 degrees. `status` is an
/// AgentStatus, and `events` are Event bits. `action` is 1 + the action's index, or 0 if the agent did not choose an
/// action itself.
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

/// Unit of rewards. It is small, because the smallest term of a step, the time penalty, is 2.5e-6.
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

/// Stationary road user: a parked car, or a road user that a probe inserts.
struct ReplayBox {
  ReplayBody body;
  int32_t x_cm = 0, y_cm = 0, z_cm = 0, heading_ddeg = 0;  // heading in tenths of a degree
  bool operator==(const ReplayBox&) const = default;
};

/// Goal chain (waypoints) of an agent from frame `frame` on.
struct ReplayChain {
  int32_t frame = 0, agent = 0;
  std::array<int32_t, kNumWaypoints> x_cm{}, y_cm{}, z_cm{};
  bool operator==(const ReplayChain&) const = default;
};

struct ReplayEpisode {
  int32_t index = 0;  // index in the simulator
  int32_t first_frame = 0, num_frames = 0;
  std::vector<ReplayBody> agents;   // [agents]
  std::vector<float> conditioning;  // [agents, kNumConditioning]
  std::vector<ReplayBox> parked;
  std::vector<ReplayChain> chains;  // in the order of frames
  bool operator==(const ReplayEpisode&) const = default;
};

enum class ShapeKind : uint8_t {
  lane,           // ring; ReplayShape::detail is a LaneType
  crosswalk,      // ring
  parking_space,  // ring
  marking,        // line; ReplayShape::detail is a MarkColor
  stop_line,      // line
  road_edge,      // line
  wall,           // line
  // Points: both ends of the stop line, the head, and a point one metre in front of the head. Lights are in the order
  // of the map.
  light,
};
constexpr int kNumShapeKinds = 8;

/// Shape of the map from above.
struct ReplayShape {
  ShapeKind kind = ShapeKind::lane;
  int32_t detail = 0, width_cm = 0;
  std::vector<std::array<int32_t, 2>> points_cm;
  bool operator==(const ReplayShape&) const = default;
};

/// Colour before distance fades it: [red, green, blue].
using ReplayHue = std::array<uint8_t, 3>;
using ReplayPoint = std::array<int32_t, 3>;  // x, y, z in cm

/// A painted line of the map, for drawing images (docs/explanation/image.md). append_strips() converts its points to
/// strips. Lines are in the order of the map's strips.
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
  ReplayPoint a_cm{}, b_cm{};  // ends of its foot
  bool operator==(const ReplayWall&) const = default;
};
struct ReplayHead {
  int32_t signal = 0;  // index in the lights of a frame
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

/// Number of values of a decision, which is the response of the followed agent's policy to a frame. The values are the
/// probability of each action, then the policy's value, in units of kDecisionUnit. All are 0 if the policy was not
/// evaluated.
constexpr size_t kDecisionValues = kNumActions + 1;
constexpr double kDecisionUnit = 1e-4;

/// Camera on an agent's body, with the members of Camera.
struct ReplayCamera {
  std::string name;
  int32_t width_px = 0, height_px = 0;
  float focal_x_px = 0, focal_y_px = 0, center_x_px = 0, center_y_px = 0;
  float x_m = 0, y_m = 0, z_m = 0, yaw_rad = 0, pitch_rad = 0, roll_rad = 0;
  bool operator==(const ReplayCamera&) const = default;
};

/// Compressed images of the followed agent, from the first frame on. Each group contains frames_per_group frames,
/// except the last group, which may contain fewer.
struct ReplayImages {
  int32_t frames_per_group = 0;
  std::vector<std::string> groups;  // see images.h
  bool operator==(const ReplayImages&) const = default;
};

/// Origin of a replay. Pages and galleries show it.
struct ReplayOrigin {
  std::string command, commit, version;
  std::string map, map_hash;
  // The map's origin in the coordinates of the map file; zero in replay files without this value.
  std::array<double, 3> map_origin_m{};
  std::string policy, policy_hash;
  std::string light_cycles;  // from light_cycles_text(); empty in files that lack them
  uint64_t seed = 0;
  uint32_t global_world = 0;
  float dt_s = 0.1f;
  bool operator==(const ReplayOrigin&) const = default;
};

/// Metrics of the whole recording. Events are counted in agent-steps: one for each agent and step with the event.
struct ReplayMetrics {
  int64_t spawned = 0, agent_steps = 0;
  int64_t collisions = 0, at_fault_collisions = 0, off_road = 0, red_light = 0, wall_contacts = 0;
  int64_t goals_reached = 0, waypoints_reached = 0;
  double km_driven = 0, reward = 0;
  bool operator==(const ReplayMetrics&) const = default;
};
// List of the metrics, as X(name).
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

/// Response of a policy (value and probability of braking) to a state with a certain road user, and to the same state
/// without this road user.
struct ReplayResponse {
  std::string policy;
  double value = 0, value_without = 0, brake = 0, brake_without = 0;
  bool operator==(const ReplayResponse&) const = default;
};

/// Case of a probe, which tests an agent's response to one road user. The road user is removed from a frame of this
/// replay, or inserted into it. `ego` is the responding agent.
struct ReplayCase {
  std::string what;  // a sentence that describes the case
  int32_t frame = 0, ego = 0;
  int32_t removed = -1;                         // agent, or -1
  std::optional<ReplayBox> inserted;            // road user inserted into the frame of the case
  std::vector<std::array<int32_t, 2>> path_cm;  // all positions of the inserted road user, in order
  std::vector<ReplayResponse> answers;          // response of each evaluated policy
  bool operator==(const ReplayCase&) const = default;
};

/// Moment that galleries show first. Frame -1 means none.
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
  int32_t followed = -1;  // agent with decisions and images, or -1
  std::vector<ReplayShape> map;
  ReplayScenery scenery;
  std::vector<ReplayCamera> cameras;  // cameras of every agent
  float line_floor_px = 0;            // line floor (minimum line width) of the images
  std::vector<ReplayEpisode> episodes;
  std::array<std::vector<int32_t>, kNumTracks> tracks;  // [frames, agents]
  std::vector<uint8_t> lights;                          // [frames, lights] LightState
  std::vector<int32_t> decisions;                       // [frames, kDecisionValues], or empty
  ReplayImages images;                                  // has no groups if there are no images
  bool operator==(const Replay&) const = default;

  int32_t at(Track track, int frame, int agent) const {
    return tracks[static_cast<size_t>(track)]
                 [static_cast<size_t>(frame) * static_cast<size_t>(num_agents) + static_cast<size_t>(agent)];
  }
  /// Returns the number of frames, from the first on, that have images of the followed agent.
  int num_pictured_frames() const {
    const auto kept = static_cast<int64_t>(images.groups.size()) * images.frames_per_group;
    return static_cast<int>(kept < num_frames ? kept : num_frames);
  }
};

}  // namespace pictura
