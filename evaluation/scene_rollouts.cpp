#include "pictura/evaluation/scene_rollouts.h"

#include <algorithm>
#include <array>
#include <limits>
#include <optional>
#include <string_view>
#include <unordered_map>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/common/span.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/protobuf_writer.h"
#include "pictura/map/womd/wire.h"

namespace pictura {

namespace {

// Field numbers and enumeration values of the schema.
enum class Submission : uint8_t { scenario_rollouts = 1, submission_type = 2 };
enum class Rollouts : uint8_t { scenario_id = 1, joint_scenes = 2 };
enum class JointScene : uint8_t { simulated_trajectories = 1 };
enum class Trajectory : uint8_t { center_x = 2, center_y = 3, center_z = 4, heading = 5, object_id = 6 };
constexpr uint64_t kSimAgentsSubmission = 1;

/// Appends a packed field that contains one member of all states.
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

bool is_field(const womd::WireReader& reader, auto field) { return reader.field() == static_cast<uint32_t>(field); }

/// Appends the states of a trajectory; returns the object's id.
int64_t read_trajectory(std::string_view message, std::vector<SimulatedState>* states_inout) {
  std::array<std::vector<float>, 4> numbers;  // x, y, z, heading
  std::optional<int64_t> id;
  for (womd::WireReader reader(message); reader.next();) {
    if (is_field(reader, Trajectory::object_id)) {
      id = reader.integer32();
    } else if (reader.field() >= static_cast<uint32_t>(Trajectory::center_x) &&
               reader.field() <= static_cast<uint32_t>(Trajectory::heading)) {
      std::vector<float>& list = numbers[reader.field() - static_cast<uint32_t>(Trajectory::center_x)];
      reader.numbers32([&list](float number) { list.push_back(number); });
    }
  }
  if (!id) fail_field("object_id", "expected an id, got none");
  for (const std::vector<float>& list : numbers) {
    if (list.size() != numbers[0].size()) {
      fail_field("", "expected as many numbers of each kind, got {} x, {} y, {} z and {} headings", numbers[0].size(),
                 numbers[1].size(), numbers[2].size(), numbers[3].size());
    }
  }
  for (size_t i = 0; i < numbers[0].size(); ++i) {
    states_inout->push_back({numbers[0][i], numbers[1][i], numbers[2][i], numbers[3][i]});
  }
  return *id;
}

/// Adds a rollout; the first one determines the objects and the number of steps.
void read_joint_scene(std::string_view message, SceneRollouts* scene_inout) {
  const bool is_first = scene_inout->rollouts.empty();
  const auto steps = static_cast<size_t>(scene_inout->steps);
  std::vector<SimulatedState> states(scene_inout->track_ids.size() * steps), one;
  // Object id to index. In the first rollout it contains the objects read so far; in later rollouts, the objects not
  // yet read.
  std::unordered_map<int64_t, size_t> places;
  for (size_t i = 0; i < scene_inout->track_ids.size(); ++i) places[scene_inout->track_ids[i]] = i;
  size_t count = 0;
  for (womd::WireReader reader(message); reader.next();) {
    if (!is_field(reader, JointScene::simulated_trajectories)) continue;
    within("simulated_trajectories", count++, [&] {
      one.clear();
      const int64_t id = read_trajectory(reader.bytes(), &one);
      if (is_first) {
        if (scene_inout->steps == 0) scene_inout->steps = static_cast<int>(one.size());
        if (!places.emplace(id, count).second) fail_field("", "object {} occurs twice", id);
        scene_inout->track_ids.push_back(id);
      }
      if (one.size() != static_cast<size_t>(scene_inout->steps) || one.empty()) {
        fail_field("", "expected {} steps as of the others, got {}", scene_inout->steps, one.size());
      }
      if (is_first) {
        states.insert(states.end(), one.begin(), one.end());
      } else {
        const auto place = places.find(id);
        if (place == places.end()) fail_field("", "object {} occurs twice, or not in the first rollout", id);
        std::copy(one.begin(), one.end(), states.begin() + static_cast<ptrdiff_t>(place->second * steps));
        places.erase(place);
      }
    });
  }
  if (!is_first && !places.empty()) fail_field("", "object {} is missing", places.begin()->first);
  scene_inout->rollouts.push_back(std::move(states));
}

}  // namespace

void check_rollouts(const SceneProtocol& protocol) {
  const bool is_whole = protocol.densities == std::vector<double>{1.0} && protocol.others == Others::replay;
  if (protocol.start_step == kChallengeStart && protocol.steps == kChallengeSteps &&
      protocol.rollouts == kChallengeRollouts && is_whole) {
    return;
  }
  fail_usage(
      "--rollouts, --realism: expected {} rollouts of {} steps from step {}, at a density of 100 % with others=replay, "
      "as "
      "in the "
      "protocol simagents; got rollouts={}, {} steps from step {}, {}, others={}",
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
      "{}: expected at most 2 GiB, which protobuf reads as one message: use fewer scenes, with --scenarios A:B", path_);
  file_.write(bytes);
}

RolloutsReader::RolloutsReader(const std::string& path)
    : path_(path), bytes_(read_file(path, std::numeric_limits<int32_t>::max())) {
  size_t count = 0;
  try {
    for (womd::WireReader reader(bytes_); reader.next();) {
      if (is_field(reader, Submission::submission_type) &&
          reader.integer() != static_cast<int64_t>(kSimAgentsSubmission)) {
        fail_field("submission_type", "expected {}, sim agents, got {}", kSimAgentsSubmission, reader.integer());
      }
      if (!is_field(reader, Submission::scenario_rollouts)) continue;
      within("scenario_rollouts", count++, [&] {
        std::string id;
        for (womd::WireReader scene(reader.bytes()); scene.next();) {
          if (is_field(scene, Rollouts::scenario_id)) id = scene.bytes();
        }
        if (!scenes_.emplace(id, reader.bytes()).second) fail_field("", "scenario '{}' occurs twice", id);
      });
    }
  } catch (const FieldError& error) {
    throw to_error(path_, error);
  }
}

std::vector<std::string> RolloutsReader::scenario_ids() const {
  std::vector<std::string> ids;
  for (const auto& [id, message] : scenes_) ids.push_back(id);
  return ids;
}

SceneRollouts RolloutsReader::read(const std::string& scenario_id) const {
  const auto found = scenes_.find(scenario_id);
  PICTURA_CHECK(found != scenes_.end(), "{}: expected rollouts of scenario '{}', got none", path_, scenario_id);
  SceneRollouts scene;
  scene.scenario_id = scenario_id;
  try {
    for (womd::WireReader reader(found->second); reader.next();) {
      if (!is_field(reader, Rollouts::joint_scenes)) continue;
      within("joint_scenes", scene.rollouts.size(), [&] { read_joint_scene(reader.bytes(), &scene); });
    }
  } catch (const FieldError& error) {
    throw to_error(fmt::format("{}: scenario '{}'", path_, scenario_id), error);
  }
  return scene;
}

}  // namespace pictura
