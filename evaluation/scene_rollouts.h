// Rollouts of recorded scenes in the file format of the Waymo Open Sim Agents Challenge.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/support/output_file.h"
#include "pictura/simulator/scene_protocol.h"

namespace pictura {

/// Centre of a box, in the coordinates of the scene's file.
struct SimulatedState {
  float x_m = 0, y_m = 0, z_m = 0;
  float heading_rad = 0;  // in [-pi, pi], from x towards y
};

/// Rollouts of all road users present at the protocol's start, with states after each step. A road user that left or is
/// no longer recorded keeps its last state.
struct SceneRollouts {
  std::string scenario_id;
  int steps = 0;
  std::vector<int64_t> track_ids;                     // [objects]
  std::vector<std::vector<SimulatedState>> rollouts;  // [rollouts][objects * steps]
};

/// In the challenge: number of rollouts of each scene, last recorded step before them, and steps of each.
constexpr int32_t kChallengeRollouts = 32, kChallengeStart = 10, kChallengeSteps = 80;
/// Throws UsageError if the protocol differs from the challenge's, which has all present road users.
void check_rollouts(const SceneProtocol& protocol);

/// Encodes a message ScenarioRollouts (waymo_open_dataset/protos/sim_agents_submission.proto). Throws Error if a track
/// id exceeds int32.
std::string encoded(const SceneRollouts& scene);

/// Writes one message SimAgentsChallengeSubmission with type and scenes, without authors. Concatenated files are also a
/// valid message.
class RolloutsFile {
 public:
  explicit RolloutsFile(const std::string& path);
  /// Throws Error if the message would exceed protobuf's limit of 2 GiB.
  void write(const SceneRollouts& scene);
  /// Moves the complete file to its path.
  void commit() { file_.commit(); }

 private:
  void write(const std::string& bytes);

  std::string path_;
  OutputFile file_;
  size_t size_ = 0;
};

/// Reads one or several concatenated messages SimAgentsChallengeSubmission, also from other programs.
class RolloutsReader {
 public:
  /// Throws Error naming file and field for invalid bytes, another submission type, or a repeated scenario.
  explicit RolloutsReader(const std::string& path);
  std::vector<std::string> scenario_ids() const;  // alphabetical
  bool has(const std::string& scenario_id) const { return scenes_.contains(scenario_id); }
  /// Throws Error naming file, scenario and field if trajectories differ in length, rollouts differ in objects, or an
  /// object is repeated.
  SceneRollouts read(const std::string& scenario_id) const;

 private:
  std::string path_, bytes_;
  std::map<std::string, std::string_view> scenes_;  // scenario id to message ScenarioRollouts in bytes_
};

}  // namespace pictura
