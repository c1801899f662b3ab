#include "pictura/evaluation/infractions.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <map>

#include <fmt/format.h>

#include "pictura/common/math.h"
#include "pictura/common/support/file.h"
#include "pictura/evaluation/csv.h"
#include "pictura/evaluation/world_arrays.h"
#include "pictura/map/file_position.h"
#include "pictura/simulator/rules/collision.h"

namespace pictura {

namespace {

constexpr float kLaneChange_s = 3, kMergeAhead_m = 30;
constexpr float kCurveRadius_m = 50;       // maximum radius of a curve
constexpr float kJunctionTurn_rad = 0.5f;  // minimum turn of a lane in a junction that is not straight
constexpr float kJustRed_s = 1, kFarHead_m = 10;

// Point of a lane's centre line that is nearest to a position.
struct LanePlace {
  float s_m = 0;       // distance from the lane's start
  float radius_m = 0;  // radius of the line at this point, measured over 10 m to both sides
};

LanePlace place_on(const RoadMap& map, const Lane& lane, Vec2 position_m) {
  const Span<const LanePoint> points = map.points_of(lane);
  const LanePoint* const nearest = std::min_element(points.begin(), points.end(), [&](const auto& a, const auto& b) {
    return length(a.position_m.xy() - position_m) < length(b.position_m.xy() - position_m);
  });
  const LanePoint *first = nearest, *last = nearest;
  constexpr float kAround_m = 10;
  while (first != points.begin() && nearest->s_m - first->s_m < kAround_m) --first;
  while (last + 1 != points.end() && last->s_m - nearest->s_m < kAround_m) ++last;
  const float turn = std::fabs(std::remainder(last->heading_rad - first->heading_rad, 2 * kPi));
  return {nearest->s_m, turn > 0 ? (last->s_m - first->s_m) / turn : std::numeric_limits<float>::infinity()};
}

RoadShape shape_of(const RoadMap& map, const Lane& lane, const LanePlace& place) {
  if (!lane.in_junction) return place.radius_m <= kCurveRadius_m ? RoadShape::curve : RoadShape::straight;
  const Span<const LanePoint> points = map.points_of(lane);
  const float turn = std::remainder(points[points.size() - 1].heading_rad - points[0].heading_rad, 2 * kPi);
  if (std::fabs(turn) < kJunctionTurn_rad) return RoadShape::junction_straight;
  return turn > 0 ? RoadShape::junction_left : RoadShape::junction_right;
}

bool is_before_merge(const RoadMap& map, const Lane& lane, float s_m) {
  if (lane.in_junction || lane.length_m - s_m > kMergeAhead_m) return false;
  const Span<const int32_t> next = map.links(lane.successors);
  return std::any_of(next.begin(), next.end(), [&](int32_t index) {
    const Lane& successor = map.lanes[index];
    return !successor.in_junction && successor.predecessors.size() > 1;
  });
}

Contact contact_of(const AgentBox& own, const AgentBox& other) {
  const Vec2 forward{own.cos_heading, own.sin_heading}, other_forward{other.cos_heading, other.sin_heading};
  const float same = dot(forward, other_forward);
  constexpr float kCos45 = 0.70710678f;
  if (same <= -kCos45) return Contact::head_on;
  if (same < kCos45) return Contact::crossing;
  // One vehicle must be behind the other along the other's heading; a small overlap from rounding is tolerated.
  constexpr float kTouching_m = 0.2f;
  const float along = std::fabs(dot((other.center_m - own.center_m).xy(), other_forward));
  const float reach = 0.5f * other.length_m + half_extent(footprint(own), other_forward);
  return along >= reach - kTouching_m ? Contact::rear_end : Contact::side_swipe;
}

CollisionPartner partner_of(AgentClass agent_class) {
  switch (agent_class) {
    case AgentClass::vehicle: return CollisionPartner::vehicle;
    case AgentClass::cyclist: return CollisionPartner::cyclist;
    case AgentClass::pedestrian: return CollisionPartner::pedestrian;
  }
  return CollisionPartner::none;
}

}  // namespace

const char* to_string(CollisionPartner partner) {
  constexpr const char* kNames[] = {"", "vehicle", "cyclist", "pedestrian", "parked car"};
  return kNames[static_cast<size_t>(partner)];
}

const char* to_string(PartnerMotion motion) {
  constexpr const char* kNames[] = {"", "moving", "standing", "halted"};
  return kNames[static_cast<size_t>(motion)];
}
const char* to_string(Contact contact) {
  constexpr const char* kNames[] = {"", "rear-end", "side-swipe", "crossing", "head-on"};
  return kNames[static_cast<size_t>(contact)];
}
const char* to_string(RoadShape shape) {
  constexpr const char* kNames[] = {"off lanes",          "straight road",       "curve",
                                    "junction, straight", "junction, left turn", "junction, right turn"};
  return kNames[static_cast<size_t>(shape)];
}

struct InfractionObserver::Frame : WorldArrays {
  std::vector<uint8_t> events;
  std::vector<float> lane_offset_m, lane_angle_rad;
  std::vector<int32_t> lane;

  explicit Frame(Simulator& simulator) : WorldArrays(simulator) {
    const AgentStateView state = simulator.state();
    events = values_of_slots(simulator, state.events);
    lane_offset_m = values_of_slots(simulator, state.lane_offset_m);
    lane_angle_rad = values_of_slots(simulator, state.lane_angle_rad);
    lane = values_of_slots(simulator, state.lane);
  }
};

// One step of one world: arrays before and after the step. Indices of agents, boxes and lights are relative to the
// world.
struct InfractionObserver::WorldStep {
  const WorldSpec& spec;
  const RoadMap& map;
  const std::vector<StopLine>& stop_lines;  // stop lines of the map's lights
  const std::vector<LightHead>& heads;      // heads of the map's lights
  const Frame &before, &after;
  size_t first_slot, num_agents, first_box, num_boxes, first_light;

  WorldStep(Simulator& simulator, size_t world, const Frame& before_step, const Frame& after_step)
      : spec(simulator.worlds()[world]),
        map(*simulator.maps()[spec.map]->road),
        stop_lines(simulator.maps()[spec.map]->rules.stop_lines),
        heads(simulator.maps()[spec.map]->geometry.heads),
        before(before_step),
        after(after_step),
        first_slot(after.first_slot(world)),
        num_agents(after.num_agents(world)),
        first_box(after.first_box(world)),
        num_boxes(after.num_boxes(world)),
        first_light(after.first_light(world)) {}

  // Whether the agent has moved to a neighbouring lane.
  bool has_changed_lane(size_t slot) const {
    const int32_t from = before.lane[slot], to = after.lane[slot];
    if (from < 0 || to < 0 || from == to) return false;
    const Lane& lane = map.lanes[from];
    return to == lane.left_neighbor || to == lane.right_neighbor;
  }

  void describe_place(size_t agent, Infraction* out) const {
    const Vec3 center_m = before.boxes[first_box + agent].center_m;
    out->position_m = file_position_m(map.origin_m, center_m);
    const int32_t lane = before.lane[first_slot + agent];
    if (lane < 0) return;
    const Lane& on = map.lanes[lane];
    const LanePlace place = place_on(map, on, center_m.xy());
    out->shape = shape_of(map, on, place);
    out->before_merge = is_before_merge(map, on, place.s_m);
  }

  // Describes the nearest box with which the agent collided.
  void describe_partner(size_t agent, Infraction* out) const {
    const AgentBox &own = before.boxes[first_box + agent], &own_after = after.boxes[first_box + agent];
    float least_m = std::numeric_limits<float>::infinity();
    for (size_t other = 0; other < num_boxes; ++other) {
      const bool is_parked = other >= num_agents;
      if (other == agent) continue;
      if (!is_parked && !has_body(before.status[first_slot + other])) continue;
      const AgentBox &its = before.boxes[first_box + other], &its_after = after.boxes[first_box + other];
      const float apart_m = length((its.center_m - own.center_m).xy());
      if (apart_m >= least_m || !collide(own, own_after, its, its_after)) continue;
      least_m = apart_m;
      out->partner_agent = static_cast<int>(other);
      out->partner = is_parked ? CollisionPartner::parked_car : partner_of(its.agent_class);
      out->contact = contact_of(own, its);
      out->partner_speed_mps = is_parked ? 0 : before.speed_mps[first_slot + other];
      out->partner_motion = PartnerMotion::standing;
      if (!is_parked && before.status[first_slot + other] == AgentStatus::halted)
        out->partner_motion = PartnerMotion::halted;
      else if (std::fabs(out->partner_speed_mps) > kRest_mps)
        out->partner_motion = PartnerMotion::moving;
    }
  }

  // Returns the light, red during the step, whose stop line is nearest to the agent's front bumper; -1: none was red.
  int32_t nearest_red_light(size_t agent) const {
    const Vec2 bumper = front_bumper(before.boxes[first_box + agent]);
    float least_m = std::numeric_limits<float>::infinity();
    int32_t nearest = -1;
    for (size_t i = 0; i < stop_lines.size(); ++i) {
      if (!before.is_red(first_light + i)) continue;
      const float apart_m = length(stop_lines[i].middle_m.xy() - bumper);
      if (apart_m >= least_m) continue;
      least_m = apart_m;
      nearest = static_cast<int32_t>(i);
    }
    return nearest;
  }
};

InfractionObserver::InfractionObserver() = default;
InfractionObserver::~InfractionObserver() = default;

void InfractionObserver::begin(Simulator& simulator) {
  simulator_ = &simulator;
  step_ = 0;
  found_now_.clear();
  after_ = std::make_unique<Frame>(simulator);
  lane_change_step_.assign(after_->status.size(), 0);
  red_since_step_.assign(after_->lights.size(), -1);
  for (size_t i = 0; i < after_->lights.size(); ++i) {
    if (after_->is_red(i)) red_since_step_[i] = 0;
  }
}

void InfractionObserver::before_step(Span<const Command> /*commands*/) { std::swap(before_, after_); }

void InfractionObserver::after_step(const StepResult& /*result*/) {
  ++step_;
  after_ = std::make_unique<Frame>(*simulator_);
  for (size_t world = 0; world < simulator_->worlds().size(); ++world) {
    const WorldStep step(*simulator_, world, *before_, *after_);
    for (size_t agent = 0; agent < step.num_agents; ++agent) {
      const size_t slot = step.first_slot + agent;
      if (before_->status[slot] != AgentStatus::active) {
        lane_change_step_[slot] = 0;  // another agent may enter the slot
        continue;
      }
      if (step.has_changed_lane(slot)) lane_change_step_[slot] = step_;
      if (after_->status[slot] == AgentStatus::halted) found_now_.push_back(describe(step, agent));
    }
  }
  for (size_t i = 0; i < after_->lights.size(); ++i) {
    if (!after_->is_red(i))
      red_since_step_[i] = -1;
    else if (red_since_step_[i] < 0)
      red_since_step_[i] = step_;
  }
}

Infraction InfractionObserver::describe(const WorldStep& step, size_t agent) const {
  const size_t slot = step.first_slot + agent;
  const float dt_s = simulator_->config().dt_s;
  Infraction one;
  one.agents_per_world = step.spec.num_agents;
  one.scenario = static_cast<int>(step.spec.global_world - kFirstEvaluationWorld);
  one.map = step.map.name;
  one.agent = static_cast<int>(agent);
  one.step = step_;
  one.agent_class = before_->agent_class[slot];
  one.events = after_->events[slot] & (kInfractions | kEventAtFault);
  one.speed_mps = before_->speed_mps[slot];
  one.lane_offset_m = before_->lane_offset_m[slot];
  one.lane_angle_rad = before_->lane_angle_rad[slot];
  const int changed = lane_change_step_[slot];
  one.changed_lane = changed > 0 && static_cast<float>(step_ - changed) * dt_s <= kLaneChange_s;
  step.describe_place(agent, &one);
  if (one.is(kEventCollision)) step.describe_partner(agent, &one);
  if (!one.is(kEventRedLight)) return one;
  const int32_t light = step.nearest_red_light(agent);
  if (light < 0) return one;
  const int since = red_since_step_[step.first_light + static_cast<size_t>(light)];
  one.red_for_s = since > 0 ? static_cast<float>(step_ - since) * dt_s : std::numeric_limits<float>::infinity();
  const Vec3 head_m = step.heads[light].position_m;
  one.stop_line_to_head_m = length((head_m - step.stop_lines[light].middle_m).xy());
  return one;
}

void InfractionObserver::end() {
  found_.insert(found_.end(), found_now_.begin(), found_now_.end());
  found_now_.clear();
}

std::vector<InfractionGroup> group_infractions(const std::vector<Infraction>& infractions) {
  std::map<std::pair<std::string, std::string>, int64_t> counts;
  for (const Infraction& one : infractions) {
    if (one.agent_class != AgentClass::vehicle) continue;
    if (one.is(kEventAtFault)) {
      ++counts[{"at_fault", fmt::format("{} {}, {}, {}{}{}", to_string(one.partner_motion), to_string(one.partner),
                                        to_string(one.contact), to_string(one.shape),
                                        one.changed_lane ? ", after a lane change" : "",
                                        one.before_merge ? ", before a merge" : "")}];
    }
    if (one.is(kEventOffRoad)) {
      ++counts[{"off_road",
                fmt::format("{}{}", to_string(one.shape), one.changed_lane ? ", after a lane change" : "")}];
    }
    if (one.is(kEventRedLight)) {
      ++counts[{"red_light", fmt::format("red for {} {} s, head {} {} m from the line",
                                         one.red_for_s <= kJustRed_s ? "up to" : "more than", kJustRed_s,
                                         one.stop_line_to_head_m <= kFarHead_m ? "up to" : "more than", kFarHead_m)}];
    }
  }
  std::vector<InfractionGroup> groups;
  for (const auto& [key, count] : counts) groups.push_back({key.first, key.second, count});
  std::stable_sort(groups.begin(), groups.end(),
                   [](const InfractionGroup& a, const InfractionGroup& b) { return a.count > b.count; });
  return groups;
}

void write_infractions_csv(const std::string& path, const std::vector<Infraction>& infractions) {
  std::string text =
      "agents,scenario,map,agent,class,step,at_fault,collision,off_road,red_light,wall,x_m,y_m,z_m,speed_mps,lane_"
      "offset_m,"
      "lane_angle_rad,road_shape,changed_lane,before_merge,partner,partner_motion,contact,partner_agent,partner_speed_"
      "mps,"
      "red_for_s,stop_line_to_head_m\n";
  for (const Infraction& one : infractions) {
    text += fmt::format(
        "{},{},{},{},{},{},{:d},{:d},{:d},{:d},{:d},{:.2f},{:.2f},{:.2f},{:.2f},{:.2f},{:.3f},{},{:d},{:d},{},{},{},{},"
        "{:.2f},"
        "{:.1f},{:.1f}\n",
        one.agents_per_world, one.scenario, csv_quoted(one.map), one.agent, to_string(one.agent_class), one.step,
        one.is(kEventAtFault), one.is(kEventCollision), one.is(kEventOffRoad), one.is(kEventRedLight),
        one.is(kEventWall), one.position_m[0], one.position_m[1], one.position_m[2], one.speed_mps, one.lane_offset_m,
        one.lane_angle_rad, csv_quoted(to_string(one.shape)), one.changed_lane, one.before_merge,
        to_string(one.partner), to_string(one.partner_motion), to_string(one.contact), one.partner_agent,
        one.partner_speed_mps, one.red_for_s, one.stop_line_to_head_m);
  }
  write_file(path, text);
}

}  // namespace pictura
