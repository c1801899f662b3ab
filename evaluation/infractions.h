// What goes wrong in an evaluation, case by case: who did what, where, and with whom. Without torch headers.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "pictura/evaluation/evaluate.h"

namespace pictura {

/// What else took part in a collision.
enum class CollisionPartner : uint8_t { none, vehicle, cyclist, pedestrian, parked_car };
/// What it was doing when the step began: halted agents stay where they are until the episode ends.
enum class PartnerMotion : uint8_t { none, moving, standing, halted };
/// From where the two met: by the angle between their headings (up to 45 degrees, from 135 on, between), and for equal
/// directions by whether one was behind the other before they met.
enum class Contact : uint8_t { none, rear_end, side_swipe, crossing, head_on };
/// Of the lane where it happened.
enum class RoadShape : uint8_t { no_lane, straight, curve, junction_straight, junction_left, junction_right };

const char* to_string(CollisionPartner partner);
const char* to_string(AgentClass agent_class);
const char* to_string(PartnerMotion motion);
const char* to_string(Contact contact);
const char* to_string(RoadShape shape);

/// One agent's first and only one of an episode: it halts. Values are those of the step's beginning.
struct Infraction {
  int agents_per_world = 0, scenario = 0;
  std::string map;
  int agent = 0, step = 0;  // of the scenario; from 1
  AgentClass agent_class = AgentClass::vehicle;
  int events = 0;                      // of the step in which it halted: bits of Event
  std::array<double, 3> position_m{};  // in the coordinates of the map's file
  float speed_mps = 0, lane_offset_m = 0, lane_angle_rad = 0;
  RoadShape shape = RoadShape::no_lane;
  bool changed_lane = false;  // to a neighbour within the last 3 s
  bool before_merge = false;  // its lane ends within 30 m where another one joins, outside junctions
  // Of collisions.
  CollisionPartner partner = CollisionPartner::none;
  PartnerMotion partner_motion = PartnerMotion::none;
  Contact contact = Contact::none;
  int partner_agent = -1;  // of the scenario; those of parked cars follow the agents'
  float partner_speed_mps = 0;
  // Of red lights.
  float red_for_s = 0;            // how long the light has been red; infinite where it always was
  float stop_line_to_head_m = 0;  // on the ground

  bool is(Event event) const { return (events & event) != 0; }
};

/// Collects the infractions of all agents of an evaluation. On a device it copies what it reads to the host at every
/// step.
class InfractionObserver final : public EvaluationObserver {
 public:
  InfractionObserver();
  ~InfractionObserver() override;

  void begin(Simulator& simulator) override;
  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;
  void end() override;

  /// Of worlds that are at their end, in the order in which they happened.
  const std::vector<Infraction>& found() const { return found_; }

 private:
  struct Frame;
  struct WorldStep;
  Infraction describe(const WorldStep& step, size_t agent) const;

  std::vector<Infraction> found_, found_now_;  // of worlds that were, and that are evaluated
  std::unique_ptr<Frame> before_, after_;
  Simulator* simulator_ = nullptr;
  int step_ = 0;
  std::vector<int> lane_change_step_;  // [slots] 0: none yet
  std::vector<int> red_since_step_;    // [lights of all worlds] -1: not red
};

/// Vehicles that did the same in the same way, the commonest first.
struct InfractionGroup {
  std::string kind;  // at_fault, off_road, red_light
  std::string how;
  int64_t count = 0;
};
/// The paper's three infractions of vehicles, each by what describes it: collisions by partner, its motion, contact,
/// road shape and lane changes and merges; leaving the road by its shape; red lights by how long they were red and
/// where the head stands.
std::vector<InfractionGroup> group_infractions(const std::vector<Infraction>& infractions);

/// All of them, a row each. Throws Error naming the path.
void write_infractions_csv(const std::string& path, const std::vector<Infraction>& infractions);

}  // namespace pictura
