// Settings of evaluations in recorded scenes: the paper's zero-shot protocol, protocols of other published results, and
// every rule that can be changed. Has no torch headers.
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

/// Protocol: the driven road users, their goals, and the treatment of events. The default values are the paper's
/// (zero-shot evaluation, appendix B), and ours where the paper is silent; docs/explanation/evaluation.md lists which.
struct SceneProtocol {
  std::string name = "womd";
  std::string control = "self,vehicles";  // tracks_selected_by() of the scene
  int start_step = 0;                     // first step in the recording
  int steps = 600;
  std::vector<double> densities{1.0, 0.75, 0.5};  // shares of a scene's road users that remain
  int rollouts = 1;                               // drives of each scene, each with its own draws
  float box_scale = 1;                            // scale of all lengths and widths
  // Minimum distance from the start to the goal; a road user that starts nearer follows the recording. 0: no minimum.
  float min_distance_to_goal_m = 2;
  bool replay_experts = false;  // replays road users that the file marks for replay
  int max_driven = 0;  // > 0: drives only the self-driving car and the first others of a scene, up to this number
  Overlapping overlapping = Overlapping::replay;  // whose initial box touches a box or an edge, or is off the road
  Others others = Others::replay;                 // pedestrians, cyclists and other non-vehicles
  Late late = Late::replay;
  RecordEnd record_end = RecordEnd::stand;  // what road users that follow the recording do after its end
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = true;
  Waypoints waypoints = Waypoints::goal;  // the goal three times, or points on the recorded path before it
  float observed_span_m = 5;              // see MapOptions
};

/// Returns the protocols: the paper's, gpudrive, pufferdrive2, pufferdrive3, waymax and simagents, all defined in this
/// one place.
const std::vector<SceneProtocol>& scene_protocols();
std::vector<std::string> scene_protocol_names();
/// Returns the protocol of this name. Throws UsageError listing the names.
SceneProtocol scene_protocol(const std::string& name);

/// Setting that can be changed by name.
struct SceneRule {
  const char* name;
  const char* values;  // for instance "replay, drive, absent" or "0 to 2"
  const char* what;
};
std::vector<SceneRule> scene_rules();
/// Sets a rule from "name=value". Throws UsageError listing names or values.
void set_scene_rule(const std::string& assignment, SceneProtocol* protocol_inout);
/// Returns names and values of all rules.
std::vector<std::pair<std::string, std::string>> rules_of(const SceneProtocol& protocol);

/// Throws UsageError naming an invalid setting: steps below 1, densities that are not above 0 and at most 1, or words
/// that name no tracks.
void check(const SceneProtocol& protocol);

/// Row of the paper's table on WOMD (zero-shot self-play, 44,073 scenes of the validation set).
struct PaperSceneRow {
  const char* agent;
  double density, at_fault, off_road, goals;
};
const std::vector<PaperSceneRow>& paper_scene_rows();

}  // namespace pictura
