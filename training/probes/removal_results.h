// What policies made of road users that were taken away: every case, means by how occluded the user was, and the files
// that hold them. Without torch headers.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/training/evaluation/results.h"

namespace pictura {

/// Who is hidden in a case.
enum class RemovalControl : uint8_t {
  none,      // the user that the case is about
  nobody,    // a control: nothing may change
  permuted,  // a control: another one of the ego's road users, drawn anew for each case; nobody where it has none
};
constexpr std::array<const char*, 3> kRemovalControlNames{"none", "nobody", "permuted"};
/// Throws UsageError listing the names.
RemovalControl removal_control_named(const std::string& name);

/// One road user hidden for one ego, in one state. Agents are numbered in their world.
struct RemovalCase {
  int32_t scene = 0, map = 0, driver = 0;  // the number of its scenario; indices of its map and of who drove
  int32_t step = 0;                        // steps done in the scenario
  int32_t ego = 0, user = 0;
  int32_t hidden = -1;  // who was hidden, -1: nobody; the user without a control
  AgentClass user_class = AgentClass::vehicle;
  bool user_halted = false;
  float distance_m = 0;  // on the ground, from the ego's rear axle to the middle of the user
  float ego_speed_mps = 0;
  float visible_share = 0;  // of the user, in the ego's cameras: Renderer::visibility; NaN: in no camera's frame

  bool is_in_frame() const { return visible_share == visible_share; }
  float occlusion() const { return 1 - visible_share; }
};

/// What a policy makes of a state as it is, V(o) and P(brake | o), and of that without the hidden user, o'.
struct RemovalResponse {
  float value = 0, value_without = 0;
  float brake = 0, brake_without = 0;

  double value_change() const { return double{value} - double{value_without}; }
  double brake_change() const { return double{brake} - double{brake_without}; }
  bool is_unchanged() const { return value == value_without && brake == brake_without; }
};

struct ProbedPolicy {
  std::string name;  // of its file or run; unique
  std::string path, hash;
  bool reads_images = false;
};

struct RemovalResults {
  EvaluationSetting setting;  // of the worlds; what of it is a policy's is the first one's
  std::string density;
  int agents_per_world = 0;
  int first_scene = 0, scenes = 0;  // which were driven: an equal share by each policy, in their order
  int64_t removals_asked = 0;
  int sample_steps = 0;
  float range_m = 0;
  RemovalControl control = RemovalControl::none;
  std::vector<ProbedPolicy> policies;
  std::vector<RemovalCase> cases;          // by scene, step, ego and user, for each driver
  std::vector<RemovalResponse> responses;  // [cases, policies]
  bool interrupted = false;
  double seconds = 0;

  const RemovalResponse& response(size_t one, size_t policy) const { return responses[one * policies.size() + policy]; }
};

/// Cases of one kind: how much of the user is occluded, and how far away it is.
struct RemovalGroup {
  static constexpr int kOcclusionBins = 10;
  /// -1: users in no camera's frame. [0, kOcclusionBins): occlusions from bin / 10, up to but without (bin + 1) / 10.
  /// kOcclusionBins: in the frame, and wholly hidden.
  int occlusion_bin = -1;
  std::optional<int> distance_band;  // of kDistanceBand_m, from 0; all distances without

  /// "no camera", "0-10 %", ..., "hidden".
  std::string occlusion_name() const;
};
constexpr float kDistanceBand_m = 10;

/// One policy's responses to the cases of one group. Estimates are over scenes: the mean over scenes of the means of
/// their cases, with its 95 % interval; infinite where there are none.
struct RemovalRow {
  int policy = 0;
  RemovalGroup group;
  int64_t cases = 0;
  int scenes = 0;             // that have such cases
  double mean_occlusion = 0;  // of the cases; NaN outside frames
  Estimate abs_value_change, abs_brake_change;
  Estimate value_change, brake_change;  // signed
  Estimate changed_share;               // of the cases: in which value or probability are not the same bits
};

/// For each policy all distances, then each band; of each the bins of occlusion and those in no frame.
std::vector<RemovalRow> summarize(const RemovalResults& results);

/// A row a case, with a header: what it is, and for each policy value, d_value, p_brake and d_p_brake. Throws Error
/// naming the path.
void write_removal_cases(const std::string& path, const RemovalResults& results);

/// Results and rows as one JSON object's text; `cases_file` names where the cases are, and may be empty.
std::string removal_summary_json(const RemovalResults& results, const std::vector<RemovalRow>& rows,
                                 const std::string& cases_file);

}  // namespace pictura
