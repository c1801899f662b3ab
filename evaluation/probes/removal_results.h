// Results of the removal probe.
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
  none,       // the case's user
  unchanged,  // control: no road user is hidden, so no response may change
  permuted,   // control: another road user near the ego, drawn at random; none if there is no other
  untrained,  // control: the case's user; the policies have fresh weights
};
constexpr std::array<const char*, 4> kRemovalControlNames{"none", "unchanged", "permuted", "untrained"};

/// One road user hidden from one ego in one state. Agent indices are within their world.
struct RemovalCase {
  int32_t scene = 0, map = 0, driver = 0;  // scene: scenario number; map, driver: indices
  int32_t step = 0;                        // completed steps
  int32_t ego = 0, user = 0;
  int32_t hidden = -1;  // agent chosen by RemovalControl; -1: none
  AgentClass user_class = AgentClass::vehicle;
  bool user_halted = false;
  float distance_m = 0;  // on the ground, from the ego's rear axle to the user's centre
  float ego_speed_mps = 0;
  /// See Renderer::visibility; NaN: outside all cameras' frames.
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

struct RemovalGroup {
  static constexpr int kOcclusionBins = 10;
  /// -1: outside all frames. Below kOcclusionBins: occlusion in [bin / 10, (bin + 1) / 10). kOcclusionBins: wholly
  /// hidden within a frame.
  int occlusion_bin = -1;
  std::optional<int> distance_band;  // in units of kDistanceBand_m; empty: all distances

  /// "no camera", "0-10 %", ..., "hidden".
  std::string occlusion_name() const;
};
constexpr float kDistanceBand_m = 10;

struct RemovalRow : ResponseMeans {
  int policy = 0;
  RemovalGroup group;
  double mean_occlusion = 0;  // NaN outside all frames
};

/// Returns each policy's rows of all distances, then of each distance band. Rows ascend by bin; users outside all
/// frames come last.
std::vector<RemovalRow> summarize(const RemovalResults& results);

/// Writes a CSV row per case, which ends with the columns of response_header(). Throws Error naming the path.
void write_removal_cases(const std::string& path, const RemovalResults& results);

/// Returns one JSON object. `cases_file`: path of the CSV file, or empty.
std::string removal_summary_json(const RemovalResults& results, const std::vector<RemovalRow>& rows,
                                 const std::string& cases_file);

}  // namespace pictura
