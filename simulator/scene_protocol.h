// Settings of evaluations in recorded scenes: the paper's zero-shot protocol, protocols of other published results, and
// every rule that a caller can change.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/fields.h"

namespace pictura {

/// Values of protocol settings; docs/explanation/evaluation.md "Protocols" defines them.
enum class Overlapping : uint8_t { replay, drive };
enum class Others : uint8_t { replay, absent };
enum class Late : uint8_t { replay, drive, absent };
enum class RecordEnd : uint8_t { stand, vanish };
enum class Waypoints : uint8_t { goal, path };

/// Protocol of an evaluation: the road users that the policy drives, their goals, and the treatment of events. The
/// default values are the paper's (zero-shot evaluation, appendix B). If the paper states no value, the default is this
/// project's choice; docs/explanation/evaluation.md lists these choices.
struct SceneProtocol {
  std::string name = "womd";
  std::string control = "self,vehicles";  // driven road users: words for tracks_selected_by()
  int start_step = 0;                     // step of the recording at which episodes begin
  int steps = 600;
  std::vector<double> densities{1.0, 0.75, 0.5};  // shares of a scene's road users that remain
  int rollouts = 1;                               // number of drives per scene, each drive with its own random draws
  float box_scale = 1;                            // factor on the length and width of all boxes
  // Minimum distance from the start to the goal; a road user that starts nearer follows the recording. 0: no minimum.
  float min_distance_to_goal_m = 2;
  // Maximum turn between a road user's first two recorded states. After a larger turn, the road user starts with the
  // second heading, because the first heading contradicts its motion. 0: any turn.
  float max_first_turn_deg = 0;
  bool replay_experts = false;  // whether road users that the scene file marks as experts follow the recording
  // Maximum number of driven road users per scene; 0: no limit. The self-driving car comes first, then the others in
  // the order of the scene file.
  int max_driven = 0;
  // Role of road users whose initial box touches another box or the road's edge, or is off the road.
  Overlapping overlapping = Overlapping::replay;
  Others others = Others::replay;  // role of pedestrians, cyclists and other non-vehicles that `control` excludes
  Late late = Late::replay;
  RecordEnd record_end = RecordEnd::stand;  // behavior of replayed road users after the end of their recording
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = true;
  Waypoints waypoints = Waypoints::goal;  // `goal`: the goal three times; `path`: two points on the recorded path, then
                                          // the goal
  float observed_span_m = 5;              // see MapOptions
};

/// Returns the protocols: womd (the paper's), gpudrive, pufferdrive2, pufferdrive3, waymax and simagents.
const std::vector<SceneProtocol>& scene_protocols();
std::vector<std::string> scene_protocol_names();
/// Returns the protocol of this name. Throws UsageError, which lists the names, for an unknown name.
SceneProtocol scene_protocol(const std::string& name);

/// Setting of a protocol that set_scene_rule() can change.
struct SceneRule {
  const char* name;
  const char* values;  // for instance "replay, drive, absent" or "0 to 2"
  const char* what;
};
std::vector<SceneRule> scene_rules();
/// Sets a rule from "name=value". Throws UsageError, which lists the valid names or values, for an invalid name or
/// value.
void set_scene_rule(const std::string& assignment, SceneProtocol* protocol_inout);
/// Returns names and values of all rules.
std::vector<std::pair<std::string, std::string>> rules_of(const SceneProtocol& protocol);

/// Throws UsageError, which names the setting, if a setting is invalid. Examples are `steps` below 1, a density outside
/// (0, 1], and a track id or an unknown word in `control`.
void check(const SceneProtocol& protocol);

/// Row of the paper's table on the Waymo Open Motion Dataset (zero-shot self-play, 44,073 scenes of the validation
/// set).
struct PaperSceneRow {
  const char* agent;
  double density, at_fault, off_road, goals;
};
const std::vector<PaperSceneRow>& paper_scene_rows();

}  // namespace pictura
