#include "pictura/simulator/scene_protocol.h"

#include <array>
#include <cmath>

#include "pictura/common/error.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/map/scenario/scenario.h"
#include "pictura/simulator/recorded_scene.h"

namespace pictura {

namespace {

constexpr std::array<const char*, 2> kOverlappingWords{"replay", "drive"}, kOthersWords{"replay", "absent"},
    kRecordEndWords{"stand", "vanish"}, kYesNo{"no", "yes"}, kWaypointsWords{"goal", "path"};
constexpr std::array<const char*, 3> kLateWords{"replay", "drive", "absent"},
    kInfractionWords{"halt", "leave", "drive_on"};

/// Named rule that options can change: its description, and functions that parse and format its value.
struct Rule {
  SceneRule about;
  void (*set)(const std::string& name, const std::string& value, SceneProtocol* out);
  std::string (*text)(const SceneProtocol& protocol);
};

/// Makes the rule for a member that is an enumeration or a bool; kWords are the names of its values.
template <auto kMember, const auto& kWords>
constexpr Rule word_rule(const char* name, const char* values, const char* what) {
  return {{name, values, what},
          [](const std::string& its_name, const std::string& value, SceneProtocol* out) {
            using Value = std::remove_reference_t<decltype(out->*kMember)>;
            out->*kMember = static_cast<Value>(index_of_word("rule " + its_name, value, kWords));
          },
          [](const SceneProtocol& protocol) { return std::string(kWords[static_cast<size_t>(protocol.*kMember)]); }};
}

template <auto kMember, int kLow, int kHigh>
constexpr Rule number_rule(const char* name, const char* values, const char* what) {
  return {{name, values, what},
          [](const std::string& its_name, const std::string& value, SceneProtocol* out) {
            using Value = std::remove_reference_t<decltype(out->*kMember)>;
            constexpr bool kIsWhole = std::is_integral_v<Value>;
            const std::optional<double> number = parse_number(value);
            if (!number || *number < kLow || *number > kHigh || (kIsWhole && *number != std::floor(*number))) {
              fail_usage("rule {}: expected a {}number of {} to {}, got '{}'", its_name, kIsWhole ? "whole " : "", kLow,
                         kHigh, value);
            }
            out->*kMember = static_cast<Value>(*number);
          },
          [](const SceneProtocol& protocol) { return fmt::format("{}", protocol.*kMember); }};
}

using P = SceneProtocol;
constexpr std::array kRules{
    word_rule<&P::overlapping, kOverlappingWords>(
        "overlapping", "replay, drive",
        "treatment of vehicles whose initial box touches another box or an edge, or is off the road"),
    word_rule<&P::others, kOthersWords>("others", "replay, absent",
                                        "treatment of pedestrians, cyclists and other non-vehicles"),
    word_rule<&P::late, kLateWords>(
        "late", "replay, drive, absent",
        "treatment of vehicles that appear only after the start; absent applies to all road users"),
    word_rule<&P::record_end, kRecordEndWords>("record_end", "stand, vanish",
                                               "behaviour of road users that follow the recording, after its end"),
    word_rule<&P::after_infraction, kInfractionWords>("after_infraction", "halt, leave, drive_on",
                                                      "behaviour of agents that collided or left the road"),
    word_rule<&P::leave_at_goal, kYesNo>("leave_at_goal", "no, yes", "whether agents that arrive are removed"),
    word_rule<&P::waypoints, kWaypointsWords>(
        "waypoints", "goal, path",
        "goal: the goal in all three slots; path: two points on the recorded path, and the goal"),
    number_rule<&P::min_distance_to_goal_m, 0, 1000>(
        "least_way_m", "0 to 1000", "minimum distance to the goal in m; nearer road users follow the recording"),
    number_rule<&P::max_first_turn_deg, 0, 180>(
        "max_first_turn_deg", "0 to 180",
        "maximum turn between a road user's first two recorded states; after a larger turn it starts with the second "
        "heading; 0: any"),
    word_rule<&P::replay_experts, kYesNo>("replay_experts", "no, yes",
                                          "whether road users marked as expert are replayed"),
    number_rule<&P::rollouts, 1, 1000>("rollouts", "1 to 1000",
                                       "number of rollouts of each scene, with different random numbers"),
    number_rule<&P::max_driven, 0, 4096>("max_driven", "0 to 4096",
                                         "maximum number of driven vehicles per scene; 0: all"),
    number_rule<&P::box_scale, 0, 2>("box_scale", "0 to 2", "scale of lengths and widths of all road users"),
    number_rule<&P::observed_span_m, 0, 100>(
        "observed_span_m", "0 to 100",
        "maximum length of observed pieces of lanes and edges in m; 0: 10 m, as in training")};

std::vector<SceneProtocol> make_protocols() {
  const SceneProtocol paper;

  // Emerge-Lab/gpudrive: drives at most 64 moving vehicles that are not experts; removes agents that collide or reach
  // their goal.
  SceneProtocol gpudrive = paper;
  gpudrive.name = "gpudrive";
  gpudrive.steps = 91;
  gpudrive.densities = {1.0};
  gpudrive.box_scale = 0.7f;
  gpudrive.min_distance_to_goal_m = 0.2f;
  gpudrive.replay_experts = true;
  gpudrive.max_driven = 64;
  gpudrive.after_infraction = AfterInfraction::leave;

  // PufferDrive 2.0: boxes are smaller; agents that reach their goal leave the scene.
  SceneProtocol puffer2 = paper;
  puffer2.name = "pufferdrive2";
  puffer2.steps = 91;
  puffer2.densities = {1.0};
  puffer2.box_scale = 0.7f;
  puffer2.replay_experts = true;

  // PufferDrive 3.0, womd_multi: boxes have full size; agents that reach their goal drive on.
  SceneProtocol puffer3 = puffer2;
  puffer3.name = "pufferdrive3";
  puffer3.box_scale = 1;
  puffer3.leave_at_goal = false;

  // Waymax: drives only the self-driving car, for 8 s after 11 warm-up states. Events are counted, but do not end the
  // episode.
  SceneProtocol waymax = paper;
  waymax.name = "waymax";
  waymax.control = "self";
  waymax.start_step = 10;
  waymax.steps = 80;
  waymax.densities = {1.0};
  waymax.min_distance_to_goal_m = 0;
  waymax.overlapping = Overlapping::drive;
  waymax.after_infraction = AfterInfraction::drive_on;
  waymax.leave_at_goal = false;

  // The Waymo sim-agents challenge: drives all road users that are present at the start, in 32 rollouts, which events
  // do not end.
  SceneProtocol simagents = waymax;
  simagents.name = "simagents";
  simagents.control = "all";
  simagents.rollouts = 32;
  simagents.late = Late::absent;
  return {paper, gpudrive, puffer2, puffer3, waymax, simagents};
}

}  // namespace

const std::vector<SceneProtocol>& scene_protocols() {
  static const std::vector<SceneProtocol> protocols = make_protocols();
  return protocols;
}

std::vector<std::string> scene_protocol_names() {
  std::vector<std::string> names;
  for (const SceneProtocol& protocol : scene_protocols()) names.push_back(protocol.name);
  return names;
}

SceneProtocol scene_protocol(const std::string& name) {
  std::vector<const char*> names;
  for (const SceneProtocol& protocol : scene_protocols()) names.push_back(protocol.name.c_str());
  return scene_protocols()[index_of_word("protocol", name, names)];
}

std::vector<SceneRule> scene_rules() {
  std::vector<SceneRule> rules;
  for (const Rule& rule : kRules) rules.push_back(rule.about);
  return rules;
}

void set_scene_rule(const std::string& assignment, SceneProtocol* protocol_inout) {
  const size_t equals = assignment.find('=');
  if (equals == std::string::npos) fail_usage("rule: expected NAME=VALUE, got '{}'", assignment);
  const std::string name = assignment.substr(0, equals), value = assignment.substr(equals + 1);
  std::vector<const char*> names;
  for (const Rule& rule : kRules) names.push_back(rule.about.name);
  kRules[index_of_word("rules", name, names)].set(name, value, protocol_inout);
}

std::vector<std::pair<std::string, std::string>> rules_of(const SceneProtocol& protocol) {
  std::vector<std::pair<std::string, std::string>> rules;
  for (const Rule& rule : kRules) rules.emplace_back(rule.about.name, rule.text(protocol));
  return rules;
}

void check(const SceneProtocol& protocol) {
  if (protocol.steps < 1) fail_usage("evaluate: expected one step or more, got {}", protocol.steps);
  if (protocol.start_step < 0) fail_usage("evaluate: start: expected a step from 0, got {}", protocol.start_step);
  if (protocol.densities.empty()) fail_usage("evaluate: expected a density or more");
  for (const double density : protocol.densities) {
    if (!(density > 0) || density > 1)
      fail_usage("evaluate: density: expected above 0 to 100 %, got {}", density * 100);
  }
  if (!(protocol.box_scale > 0)) fail_usage("rule box_scale: expected more than 0, got {}", protocol.box_scale);
  tracks_selected_by(Scenario{}, protocol.control);
}

const std::vector<PaperSceneRow>& paper_scene_rows() {
  static const std::vector<PaperSceneRow> rows{{"vectorized", 1.0, 0.015, 0.067, 0.718},
                                               {"vectorized, no auxiliary", 1.0, 0.029, 0.143, 0.585},
                                               {"perspective", 1.0, 0.006, 0.014, 0.858},
                                               {"vectorized", 0.75, 0.009, 0.070, 0.746},
                                               {"vectorized, no auxiliary", 0.75, 0.022, 0.144, 0.607},
                                               {"perspective", 0.75, 0.003, 0.013, 0.870},
                                               {"vectorized", 0.5, 0.006, 0.073, 0.773},
                                               {"vectorized, no auxiliary", 0.5, 0.015, 0.145, 0.627},
                                               {"perspective", 0.5, 0.002, 0.012, 0.881}};
  return rows;
}

}  // namespace pictura
