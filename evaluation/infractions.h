// Infractions in an evaluation, case by case.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

enum class CollisionPartner : uint8_t { none, vehicle, cyclist, pedestrian, parked_car };
/// Motion of the collision partner at the start of the step.
enum class PartnerMotion : uint8_t { none, moving, standing, halted };
/// Collision geometry, by the angle between the headings: head_on from 135 degrees, crossing from 45 degrees. Below 45
/// degrees: rear_end if one vehicle was behind the other before contact, else side_swipe.
enum class Contact : uint8_t { none, rear_end, side_swipe, crossing, head_on };
enum class RoadShape : uint8_t { no_lane, straight, curve, junction_straight, junction_left, junction_right };

const char* to_string(CollisionPartner partner);
/// Inline, so that report writers need not link infractions.cpp.
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

/// Infraction of one agent. Values are those at the start of the step. The agent then halts, so it has no second
/// infraction.
struct Infraction {
  int agents_per_world = 0, scenario = 0;
  std::string map;
  int agent = 0, step = 0;  // agent: index in its scenario; step: from 1
  AgentClass agent_class = AgentClass::vehicle;
  int events = 0;                      // bits of Event
  std::array<double, 3> position_m{};  // in the map file's coordinates
  float speed_mps = 0, lane_offset_m = 0, lane_angle_rad = 0;
  RoadShape shape = RoadShape::no_lane;
  bool changed_lane = false;  // within the last 3 s
  bool before_merge = false;  // the lane merges with another within 30 m; false in junctions
  // For collisions only:
  CollisionPartner partner = CollisionPartner::none;
  PartnerMotion partner_motion = PartnerMotion::none;
  Contact contact = Contact::none;
  int partner_agent = -1;  // index in its scenario; parked cars follow the agents
  float partner_speed_mps = 0;
  // For red-light infractions only:
  float red_for_s = 0;            // infinite if red since the episode's start
  float stop_line_to_head_m = 0;  // horizontal

  bool is(Event event) const { return (events & event) != 0; }
};

/// Collects the infractions of all agents. With a GPU, each step copies the needed data to the host.
class InfractionObserver final : public EvaluationObserver {
 public:
  InfractionObserver();
  ~InfractionObserver() override;

  void begin(Simulator& simulator) override;
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  void end() override;

  /// Infractions in completed worlds, in time order.
  const std::vector<Infraction>& found() const { return found_; }

 private:
  struct Frame;
  struct WorldStep;
  Infraction describe(const WorldStep& step, size_t agent) const;

  std::vector<Infraction> found_, found_now_;  // found_now_: of the current worlds
  std::unique_ptr<Frame> before_, after_;
  Simulator* simulator_ = nullptr;
  int step_ = 0;
  std::vector<int> lane_change_step_;  // [slots]; 0: none
  std::vector<int> red_since_step_;    // [lights of all worlds]; -1: not red
};

/// Vehicle infractions of equal kind and circumstances.
struct InfractionGroup {
  std::string kind;  // "at_fault", "off_road" or "red_light"
  std::string how;
  int64_t count = 0;
};
/// Groups the paper's three kinds of vehicle infractions by their circumstances. The largest group comes first.
std::vector<InfractionGroup> group_infractions(const std::vector<Infraction>& infractions);

/// Writes one row per infraction. Throws Error naming the path.
void write_infractions_csv(const std::string& path, const std::vector<Infraction>& infractions);

}  // namespace pictura
