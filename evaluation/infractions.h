// Infractions in an evaluation, case by case: agent, event, place, and collision partner. Includes no torch headers.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// Partner in a collision.
enum class CollisionPartner : uint8_t { none, vehicle, cyclist, pedestrian, parked_car };
/// Motion of the partner at the start of the step; halted agents keep their pose until the episode ends.
enum class PartnerMotion : uint8_t { none, moving, standing, halted };
/// Geometry of a collision, by the angle between the two headings. From 135 degrees on it is head_on, between 45 and
/// 135 degrees crossing. Up to 45 degrees it is rear_end if one vehicle was behind the other before contact, else
/// side_swipe.
enum class Contact : uint8_t { none, rear_end, side_swipe, crossing, head_on };
/// Shape of the lane at the infraction.
enum class RoadShape : uint8_t { no_lane, straight, curve, junction_straight, junction_left, junction_right };

const char* to_string(CollisionPartner partner);
/// Defined inline, so that code which writes reports need not link infractions.cpp.
inline const char* to_string(AgentClass agent_class) {
  switch (agent_class) {
    case AgentClass::vehicle: return "vehicle";
    case AgentClass::cyclist: return "cyclist";
    case AgentClass::pedestrian: return "pedestrian";
  }
  return "";
}
const char* to_string(PartnerMotion motion);
const char* to_string(Contact contact);
const char* to_string(RoadShape shape);

/// Infraction of one agent. An agent has at most one per episode, because it then halts. Values are those at the start
/// of the step in which the infraction happens.
struct Infraction {
  int agents_per_world = 0, scenario = 0;
  std::string map;
  int agent = 0, step = 0;  // agent: index in its scenario; step: counted from 1
  AgentClass agent_class = AgentClass::vehicle;
  int events = 0;                      // bits of Event that were set in the step in which the agent halted
  std::array<double, 3> position_m{};  // in the coordinates of the map's file
  float speed_mps = 0, lane_offset_m = 0, lane_angle_rad = 0;
  RoadShape shape = RoadShape::no_lane;
  bool changed_lane = false;  // whether the agent moved to a neighbouring lane within the last 3 s
  bool before_merge = false;  // outside junctions: whether the lane merges with another lane within 30 m
  // Set for collisions only:
  CollisionPartner partner = CollisionPartner::none;
  PartnerMotion partner_motion = PartnerMotion::none;
  Contact contact = Contact::none;
  int partner_agent = -1;  // index in its scenario; parked cars are numbered after the agents
  float partner_speed_mps = 0;
  // Set for red-light infractions only:
  float red_for_s = 0;  // time since the light turned red; infinite if it has been red since the episode's start
  float stop_line_to_head_m = 0;  // horizontal distance from the stop line to the light's head

  bool is(Event event) const { return (events & event) != 0; }
};

/// Collects the infractions of all agents of an evaluation. If the simulator runs on a GPU, the data that the observer
/// reads are copied to the host at every step.
class InfractionObserver final : public EvaluationObserver {
 public:
  InfractionObserver();
  ~InfractionObserver() override;

  void begin(Simulator& simulator) override;
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  void end() override;

  /// Infractions in completed worlds, in the order in which the infractions happened.
  const std::vector<Infraction>& found() const { return found_; }

 private:
  struct Frame;
  struct WorldStep;
  Infraction describe(const WorldStep& step, size_t agent) const;

  std::vector<Infraction> found_, found_now_;  // found_now_: infractions of the worlds that are being driven
  std::unique_ptr<Frame> before_, after_;
  Simulator* simulator_ = nullptr;
  int step_ = 0;
  std::vector<int> lane_change_step_;  // [slots] step of the last lane change; 0: none yet
  std::vector<int> red_since_step_;    // [lights of all worlds] step at which the light turned red; -1: not red
};

/// Group of vehicles with the same kind and circumstances of infraction.
struct InfractionGroup {
  std::string kind;  // "at_fault", "off_road" or "red_light"
  std::string how;
  int64_t count = 0;
};
/// Groups the paper's three kinds of infractions of vehicles by their circumstances. The most frequent group comes
/// first. Collisions at fault are grouped by partner, the partner's motion, contact, road shape, lane changes and
/// merges. Off-road infractions are grouped by road shape. Red-light infractions are grouped by the time since the
/// light turned red and by the position of the light's head.
std::vector<InfractionGroup> group_infractions(const std::vector<Infraction>& infractions);

/// Writes all infractions, one row each. Throws Error naming the path.
void write_infractions_csv(const std::string& path, const std::vector<Infraction>& infractions);

}  // namespace pictura
