// Protocols of evaluations in recorded scenes: the paper's and those of other published results.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/fields.h"

namespace pictura {

/// Values of protocol settings; see docs/explanation/evaluation.md "Protocols".
enum class Overlapping : uint8_t { replay, drive };
enum class Others : uint8_t { replay, absent };
enum class Late : uint8_t { replay, drive, absent };
enum class RecordEnd : uint8_t { stand, vanish };
enum class Waypoints : uint8_t { goal, path };

/// Evaluation protocol. Defaults are the paper's (zero-shot evaluation, appendix B) or, where it states none, this
/// project's choice (docs/explanation/evaluation.md).
struct SceneProtocol {
  std::string name = "womd";
  std::string control = "self,vehicles";  // words for tracks_selected_by()
  int start_step = 0;                     // recorded step at episode starts
  int steps = 600;
  std::vector<double> densities{1.0, 0.75, 0.5};  // remaining shares of a scene's road users
  int rollouts = 1;                               // drives per scene, each with its own random draws
  float box_scale = 1;                            // factor on length and width of boxes
  // A road user within this distance of its goal at the start follows the recording; 0: none does.
  float min_distance_to_goal_m = 2;
  // Maximum turn between the first two recorded states; 0: any. After a larger turn, a road user starts with the second
  // heading, because the first contradicts its motion.
  float max_first_turn_deg = 0;
  bool replay_experts = false;  // road users marked as experts in the scene file
  // Maximum per scene; 0: no limit. The self-driving car comes first, then the order of the file applies.
  int max_driven = 0;
  // Role of road users whose initial box touches another box or the road's edge, or is off the road.
  Overlapping overlapping = Overlapping::replay;
  Others others = Others::replay;  // non-vehicles that `control` excludes
  Late late = Late::replay;
  RecordEnd record_end = RecordEnd::stand;  // replayed road users after their recording
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = true;
  Waypoints waypoints = Waypoints::goal;  // `path`: two points on the recorded path, then the goal
  float observed_span_m = 5;              // see MapOptions
};

/// womd (the paper's), gpudrive, pufferdrive2, pufferdrive3, waymax and simagents.
const std::vector<SceneProtocol>& scene_protocols();
std::vector<std::string> scene_protocol_names();
/// Throws UsageError, which lists the names, for an unknown name.
SceneProtocol scene_protocol(const std::string& name);

/// Setting that set_scene_rule() can change.
struct SceneRule {
  const char* name;
  const char* values;  // such as "replay, drive, absent" or "0 to 2"
  const char* what;
};
std::vector<SceneRule> scene_rules();
/// Sets a rule from "name=value". Throws UsageError, which lists valid names or values, for an invalid one.
void set_scene_rule(const std::string& assignment, SceneProtocol* protocol_inout);
std::vector<std::pair<std::string, std::string>> rules_of(const SceneProtocol& protocol);

/// Throws UsageError, which names the setting, for an invalid setting.
void check(const SceneProtocol& protocol);

/// Row of the paper's table on the Waymo Open Motion Dataset (zero-shot self-play, 44,073 validation scenes).
struct PaperSceneRow {
  const char* agent;
  double density, at_fault, off_road, goals;
};
const std::vector<PaperSceneRow>& paper_scene_rows();

}  // namespace pictura
