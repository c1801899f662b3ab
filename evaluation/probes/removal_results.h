// Responses of policies to the removal of road users: each case, means by the road user's occlusion, and files with
// both. Includes no torch headers.
#pragma once

#include <array>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/scene_types.h"
#include "pictura/evaluation/probes/probe_results.h"

namespace pictura {

/// Road user that is hidden in a case.
enum class RemovalControl : uint8_t {
  none,       // the user of the case
  nobody,     // a control: no user, so no response may change
  permuted,   // a control: another road user near the ego, drawn at random for each case; none if there is no other
  untrained,  // a control: the user of the case, but the responding policies have fresh weights
};
constexpr std::array<const char*, 4> kRemovalControlNames{"none", "nobody", "permuted", "untrained"};

/// Case: one road user hidden from one ego, in one state. Agents are numbered within their world.
struct RemovalCase {
  int32_t scene = 0, map = 0, driver = 0;  // number of the scenario; indices of its map and driver
  int32_t step = 0;                        // steps done in the scenario
  int32_t ego = 0, user = 0;
  int32_t hidden = -1;  // hidden agent as RemovalControl says; -1: none
  AgentClass user_class = AgentClass::vehicle;
  bool user_halted = false;
  float distance_m = 0;  // on the ground, from the ego's rear axle to the centre of the user
  float ego_speed_mps = 0;
  /// Share of the user that the ego's cameras show, see Renderer::visibility; NaN: outside all cameras' frames.
  float visible_share = 0;

  bool is_in_frame() const { return visible_share == visible_share; }
  float occlusion() const { return 1 - visible_share; }
};

struct RemovalResults : ProbeResults {
  int64_t removals_asked = 0;
  float range_m = 0;
  RemovalControl control = RemovalControl::none;
  std::vector<RemovalCase> cases;  // ordered by scene, step, ego and user
};

/// Group of cases by the user's occlusion and distance.
struct RemovalGroup {
  static constexpr int kOcclusionBins = 10;
  /// Bin of occlusion. -1: users outside all cameras' frames. Below kOcclusionBins: occlusions in [bin / 10, (bin + 1)
  /// / 10). kOcclusionBins: users within a frame that are wholly hidden.
  int occlusion_bin = -1;
  std::optional<int> distance_band;  // band of kDistanceBand_m, counted from 0; empty: all distances

  /// Name of the bin: "no camera", "0-10 %", ..., "hidden".
  std::string occlusion_name() const;
};
constexpr float kDistanceBand_m = 10;

/// Responses of one policy to the cases of one group.
struct RemovalRow : ResponseMeans {
  int policy = 0;
  RemovalGroup group;
  double mean_occlusion = 0;  // mean over the cases; NaN for users outside all frames
};

/// Returns the rows. For each policy, rows of all distances together come first, then rows of each distance band. Each
/// of these sets has one row per bin of occlusion, and a last row for users outside all frames.
std::vector<RemovalRow> summarize(const RemovalResults& results);

/// Writes a CSV file with a header and a row for each case. The columns are the case's data, then value, d_value,
/// p_brake and d_p_brake of each policy. Throws Error naming the path.
void write_removal_cases(const std::string& path, const RemovalResults& results);

/// Returns results and rows as the text of one JSON object. `cases_file` is the path of the file of cases; it may be
/// empty.
std::string removal_summary_json(const RemovalResults& results, const std::vector<RemovalRow>& rows,
                                 const std::string& cases_file);

}  // namespace pictura
