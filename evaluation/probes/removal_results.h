// What policies made of road users that were taken away: every case, means by how occluded the user was, and the files
// that hold them. Without torch headers.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/evaluation/probes/probe_results.h"

namespace pictura {

/// Who is hidden in a case.
enum class RemovalControl : uint8_t {
  none,       // the user that the case is about
  nobody,     // a control: nothing may change
  permuted,   // a control: another one of the ego's road users, drawn anew for each case; nobody where it has none
  untrained,  // a control: the user, and policies with fresh weights answer in the same states
};
constexpr std::array<const char*, 4> kRemovalControlNames{"none", "nobody", "permuted", "untrained"};

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

struct RemovalResults : ProbeResults {
  int64_t removals_asked = 0;
  float range_m = 0;
  RemovalControl control = RemovalControl::none;
  std::vector<RemovalCase> cases;  // by scene, step, ego and user, for each driver
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

/// One policy's responses to the cases of one group.
struct RemovalRow : ResponseMeans {
  int policy = 0;
  RemovalGroup group;
  double mean_occlusion = 0;  // of the cases; NaN outside frames
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
