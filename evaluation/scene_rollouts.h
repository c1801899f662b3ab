// Rollouts of recorded scenes as the Waymo Open Sim Agents Challenge defines them, and a writer and a reader of their
// file format. realism.h scores rollouts. Includes no torch headers.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/support/output_file.h"
#include "pictura/simulator/scene_protocol.h"

namespace pictura {

/// Centre of a road user's box, in the coordinates of the scene's file.
struct SimulatedState {
  float x_m = 0, y_m = 0, z_m = 0;
  float heading_rad = 0;  // in [-pi, pi], from x towards y
};

/// Rollouts of one scene. They contain all road users that are present at the protocol's start, with their states after
/// each step of each rollout. A road user that left, or that the recording no longer contains, keeps its last state.
struct SceneRollouts {
  std::string scenario_id;
  int steps = 0;
  std::vector<int64_t> track_ids;                     // [objects]
  std::vector<std::vector<SimulatedState>> rollouts;  // [rollouts][objects * steps]
};

/// Throws UsageError if the protocol differs from the challenge's: 32 rollouts of 80 steps from step 10 on, with all
/// road users that are present.
void check_rollouts(const SceneProtocol& protocol);

/// Encodes a scene as a message ScenarioRollouts of the challenge's schema
/// (waymo_open_dataset/protos/sim_agents_submission.proto, proto2). Throws Error for a track id that does not fit into
/// the schema's int32.
std::string encoded(const SceneRollouts& scene);

/// Writer of a file with one message SimAgentsChallengeSubmission. The message contains the type and the scenes of a
/// submission, but no authors. The concatenation of several such files is also a valid message.
class RolloutsFile {
 public:
  explicit RolloutsFile(const std::string& path);
  /// Appends a scene. Throws Error if the message would exceed 2 GiB, because protobuf cannot read larger messages.
  void write(const SceneRollouts& scene);
  /// Moves the complete file to its path, see OutputFile.
  void commit() { file_.commit(); }

 private:
  void write(const std::string& bytes);

  std::string path_;
  OutputFile file_;
  size_t size_ = 0;  // bytes
};

/// Reader of a file of one or several concatenated messages SimAgentsChallengeSubmission, written by RolloutsFile or by
/// another program.
class RolloutsReader {
 public:
  /// Reads the file and lists its scenes. Throws Error naming the file and the field if the bytes are not
  /// SimAgentsChallengeSubmission messages, the submission has another type, or a scenario occurs twice.
  explicit RolloutsReader(const std::string& path);
  std::vector<std::string> scenario_ids() const;  // in alphabetical order
  bool has(const std::string& scenario_id) const { return scenes_.contains(scenario_id); }
  /// Reads one scene. Throws Error naming file, scenario and field if trajectories have different lengths, rollouts
  /// contain different objects, or an object occurs twice.
  SceneRollouts read(const std::string& scenario_id) const;

 private:
  std::string path_, bytes_;
  std::map<std::string, std::string_view> scenes_;  // by scenario id: its message ScenarioRollouts, a part of bytes_
};

}  // namespace pictura
