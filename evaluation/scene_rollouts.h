// Rollouts of recorded scenes in the shape that the Waymo Open Sim Agents Challenge asks for, and their file. Nothing
// here scores them. Without torch headers.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/common/support/output_file.h"
#include "pictura/evaluation/scene_protocol.h"

namespace pictura {

/// The centre of a road user's box, in the coordinates of the scene's file.
struct SimulatedState {
  float x_m = 0, y_m = 0, z_m = 0;
  float heading_rad = 0;  // in [-pi, pi], from x towards y
};

/// One scene: of every road user that the recording has at the protocol's start, where it was after each step of each
/// rollout. Who left, or whom the recording lost, stays where it was last.
struct SceneRollouts {
  std::string scenario_id;
  int steps = 0;
  std::vector<int64_t> track_ids;                     // [objects]
  std::vector<std::vector<SimulatedState>> rollouts;  // [rollouts][objects * steps]
};

/// Throws UsageError unless the protocol is what the challenge asks for: 32 rollouts of 80 steps from step 10 on, of
/// all road users that are there.
void check_rollouts(const SceneProtocol& protocol);

/// A scene as a message ScenarioRollouts of the challenge's schema
/// (waymo_open_dataset/protos/sim_agents_submission.proto, proto2). Throws Error for ids that its int32 has no room
/// for.
std::string encoded(const SceneRollouts& scene);

/// A file of one message SimAgentsChallengeSubmission, with its type and scenes and nothing of its authors. Such files
/// one after the other are such a message too.
class RolloutsFile {
 public:
  explicit RolloutsFile(const std::string& path);
  /// Appends a scene. Throws Error where the message would become longer than 2 GiB, which protobuf does not read.
  void write(const SceneRollouts& scene);
  /// Puts the file in place, see OutputFile.
  void commit() { file_.commit(); }

 private:
  void write(const std::string& bytes);

  std::string path_;
  OutputFile file_;
  size_t size_ = 0;  // bytes
};

}  // namespace pictura
