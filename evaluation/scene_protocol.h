// The settings by which policies are evaluated in recorded scenes: the paper's zero-shot protocol, those that others
// publish figures of, and every rule that may be chosen otherwise. Without torch headers.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/fields.h"

namespace pictura {

/// What the settings of a protocol can be: docs/explanation/evaluation.md "Protocols" says what they are.
enum class Overlapping : uint8_t { replay, drive };
enum class Others : uint8_t { replay, absent };
enum class Late : uint8_t { replay, drive, absent };
enum class RecordEnd : uint8_t { stand, vanish };
enum class Waypoints : uint8_t { goal, path };

/// Who is driven in a recorded scene, where to, and what happens to them. The values here are the paper's (zero-shot
/// evaluation, appendix B), and ours where it is silent; docs/explanation/evaluation.md says which.
struct SceneProtocol {
  std::string name = "womd";
  std::string control = "self,vehicles";  // tracks_named() of the scene
  int start_step = 0;                     // of the recording
  int steps = 600;
  std::vector<double> densities{1.0, 0.75, 0.5};  // shares of a scene's road users that stay
  int rollouts = 1;                               // times that each scene is driven, with draws of their own
  float box_scale = 1;                            // of all lengths and widths
  // Who starts nearer to its goal than this follows the recording. 0: nobody does.
  float least_way_m = 2;
  bool replay_experts = false;                    // who the file says is to be replayed is
  int max_driven = 0;                             // > 0: of a scene, the self-driving car and the first of the others
  Overlapping overlapping = Overlapping::replay;  // whose box touches another, or an edge, or is off the road at first
  Others others = Others::replay;                 // pedestrians, cyclists and whoever is no vehicle
  Late late = Late::replay;
  RecordEnd record_end = RecordEnd::stand;  // who follows the recording after its end
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = true;
  Waypoints waypoints = Waypoints::goal;  // the goal three times, or places on the recorded path before it
  float observed_span_m = 5;              // see MapOptions
};

/// The paper's, and gpudrive, pufferdrive2, pufferdrive3, waymax and simagents, whose settings are data in this one
/// place.
const std::vector<SceneProtocol>& scene_protocols();
std::vector<std::string> scene_protocol_names();
/// Throws UsageError listing the names.
SceneProtocol scene_protocol(const std::string& name);

/// A setting that can be chosen by name.
struct SceneRule {
  const char* name;
  const char* values;  // "replay, drive, absent", "0 to 2"
  const char* what;
};
std::vector<SceneRule> scene_rules();
/// Sets the rule of "name=value". Throws UsageError listing names or values.
void set_scene_rule(const std::string& assignment, SceneProtocol* protocol_inout);
/// Names and values of all rules.
std::vector<std::pair<std::string, std::string>> rules_of(const SceneProtocol& protocol);

/// Throws UsageError naming what cannot be: steps below 1, densities that are not above 0 and at most 1, words that
/// name no tracks.
void check(const SceneProtocol& protocol);

/// A row of the paper's table on WOMD (zero-shot self-play, 44,073 scenes of the validation set).
struct PaperSceneRow {
  const char* agent;
  double density, at_fault, off_road, goals;
};
const std::vector<PaperSceneRow>& paper_scene_rows();

}  // namespace pictura
