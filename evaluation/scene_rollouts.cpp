#include "pictura/evaluation/scene_rollouts.h"

#include <limits>
#include <string_view>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/common/span.h"
#include "pictura/common/support/protobuf_writer.h"

namespace pictura {

namespace {

constexpr int kChallengeStart = 10, kChallengeSteps = 80, kChallengeRollouts = 32;

// Field numbers and enumeration values of the schema.
enum class Submission : uint8_t { scenario_rollouts = 1, submission_type = 2 };
enum class Rollouts : uint8_t { scenario_id = 1, joint_scenes = 2 };
enum class JointScene : uint8_t { simulated_trajectories = 1 };
enum class Trajectory : uint8_t { center_x = 2, center_y = 3, center_z = 4, heading = 5, object_id = 6 };
constexpr uint64_t kSimAgentsSubmission = 1;

/// Appends a packed field of one member of all states.
void append_floats(Trajectory field, Span<const SimulatedState> states, float SimulatedState::* member,
                   std::string* out) {
  std::vector<float> numbers;
  numbers.reserve(states.size());
  for (const SimulatedState& state : states) numbers.push_back(state.*member);
  append_bytes(field, {reinterpret_cast<const char*>(numbers.data()), numbers.size() * sizeof(float)}, out);
}

std::string trajectory(int64_t track_id, Span<const SimulatedState> states) {
  PICTURA_CHECK(std::in_range<int32_t>(track_id), "rollouts: expected ids of 32 bits, got track {}", track_id);
  std::string out;
  append_floats(Trajectory::center_x, states, &SimulatedState::x_m, &out);
  append_floats(Trajectory::center_y, states, &SimulatedState::y_m, &out);
  append_floats(Trajectory::center_z, states, &SimulatedState::z_m, &out);
  append_floats(Trajectory::heading, states, &SimulatedState::heading_rad, &out);
  append_integer(Trajectory::object_id, static_cast<uint64_t>(track_id), &out);
  return out;
}

}  // namespace

void check_rollouts(const SceneProtocol& protocol) {
  const bool is_whole = protocol.densities == std::vector<double>{1.0} && protocol.others == Others::replay;
  if (protocol.start_step == kChallengeStart && protocol.steps == kChallengeSteps &&
      protocol.rollouts == kChallengeRollouts && is_whole) {
    return;
  }
  fail_usage(
      "--rollouts: expected {} rollouts of {} steps from step {}, at a density of 100 % with others=replay, as the "
      "protocol simagents has; got rollouts={}, {} steps from step {}, {}, others={}",
      kChallengeRollouts, kChallengeSteps, kChallengeStart, protocol.rollouts, protocol.steps, protocol.start_step,
      protocol.densities.size() == 1 ? fmt::format("{:g} %", 100 * protocol.densities[0])
                                     : fmt::format("{} densities", protocol.densities.size()),
      protocol.others == Others::replay ? "replay" : "absent");
}

std::string encoded(const SceneRollouts& scene) {
  std::string out;
  append_bytes(Rollouts::scenario_id, scene.scenario_id, &out);
  const auto steps = static_cast<size_t>(scene.steps);
  for (const std::vector<SimulatedState>& rollout : scene.rollouts) {
    std::string joint;
    for (size_t i = 0; i < scene.track_ids.size(); ++i) {
      append_bytes(JointScene::simulated_trajectories,
                   trajectory(scene.track_ids[i], Span<const SimulatedState>(rollout).subspan(i * steps, steps)),
                   &joint);
    }
    append_bytes(Rollouts::joint_scenes, joint, &out);
  }
  return out;
}

RolloutsFile::RolloutsFile(const std::string& path) : path_(path), file_(path) {
  std::string head;
  append_integer(Submission::submission_type, kSimAgentsSubmission, &head);
  write(head);
}

void RolloutsFile::write(const SceneRollouts& scene) {
  std::string bytes;
  append_bytes(Submission::scenario_rollouts, encoded(scene), &bytes);
  write(bytes);
}

void RolloutsFile::write(const std::string& bytes) {
  size_ += bytes.size();
  PICTURA_CHECK(
      size_ <= static_cast<size_t>(std::numeric_limits<int32_t>::max()),
      "{}: expected at most 2 GiB, which protobuf reads as one message: take fewer scenes, by --scenarios A:B", path_);
  file_.write(bytes);
}

}  // namespace pictura
