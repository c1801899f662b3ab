// Implementation of Simulator::set_state().
#pragma once

#include "pictura/simulator/command.h"
#include "pictura/simulator/rules/spawn.h"
#include "pictura/simulator/state_edit.h"

namespace pictura {

/// Returns the first field with an invalid value, or `none`.
PICTURA_HD inline AgentField invalid_field(const MapView& map, const RuleOptions& options, const AgentStateView& agents,
                                           int slot) {
#define X(name, type, per_agent, first, comment)                                                      \
  for (int i = 0; i < (per_agent); ++i) {                                                             \
    if (!is_finite(static_cast<float>(agents.name[slot * (per_agent) + i]))) return AgentField::name; \
  }
  PICTURA_AGENT_FIELDS(X)
#undef X
  const auto status = agents.status[slot];
  if (status != AgentStatus::active && status != AgentStatus::halted && status != AgentStatus::absent &&
      !(status == AgentStatus::recorded && has_record(map)) && !(status == AgentStatus::waiting && map.is_open)) {
    return AgentField::status;
  }
  if (static_cast<int>(agents.agent_class[slot]) >= kNumAgentClasses) return AgentField::agent_class;
  const auto is_lane = [&map](int32_t lane) {
    return lane >= 0 && static_cast<size_t>(lane) < map.lanes.size() && map.lanes[lane].num_segments > 0;
  };
  if (agents.lane[slot] != -1 && !is_lane(agents.lane[slot])) return AgentField::lane;
  const int32_t goal_lane = agents.goal_lane[slot];
  const bool is_way = agents.agent_class[slot] == AgentClass::pedestrian
                          ? goal_lane >= 0 && static_cast<size_t>(goal_lane) < map.walk_pieces.size()
                          : is_lane(goal_lane);
  if (!is_way && !(goal_lane == -1 && (status == AgentStatus::absent || has_record(map)))) return AgentField::goal_lane;
  if (agents.next_waypoint[slot] < 0 || agents.next_waypoint[slot] >= kNumWaypoints) return AgentField::next_waypoint;
  if (agents.goal_chains[slot] < 0) return AgentField::goal_chains;
  if (agents.life[slot] < 0) return AgentField::life;
  if (agents.life_step[slot] < 0 || agents.life_step[slot] > options.episode_steps) return AgentField::life_step;
  if (agents.first_motion_step[slot] < 0 || agents.first_motion_step[slot] > options.episode_steps) {
    return AgentField::first_motion_step;
  }
  if (fabsf(agents.x_m[slot]) > kMaxCommanded_m) return AgentField::x_m;
  if (fabsf(agents.y_m[slot]) > kMaxCommanded_m) return AgentField::y_m;
  if (fabsf(agents.z_m[slot]) > kMaxCommanded_m) return AgentField::z_m;
  if (fabsf(agents.heading_rad[slot]) > kMaxCommanded_rad) return AgentField::heading_rad;
  const bool is_present = has_body(status);
  if (agents.length_m[slot] < 0 || (is_present && agents.length_m[slot] == 0)) return AgentField::length_m;
  if (agents.width_m[slot] < 0 || (is_present && agents.width_m[slot] == 0)) return AgentField::width_m;
  if (agents.height_m[slot] < 0 || agents.height_m[slot] > kMaxCommanded_m) return AgentField::height_m;
  if (square(agents.length_m[slot]) + square(agents.width_m[slot]) > square(2.0f * map.max_box_radius_m)) {
    return AgentField::length_m;
  }
  return AgentField::none;
}

/// Fields of one agent, outside the state's arrays.
struct AgentRecord {
#define X(name, type, per_agent, first, comment) type name[per_agent];
  PICTURA_AGENT_FIELDS(X)
#undef X

  PICTURA_HD AgentStateView view() {
#define X(name, type, per_agent, first, comment) .name = name,
    return {PICTURA_AGENT_FIELDS(X)};
#undef X
  }
};

/// Returns the agent of element i with new values, but with old derived fields.
PICTURA_HD inline AgentRecord edited_agent(const AgentStateView& agents, const StateEdit& edit, int i) {
  AgentRecord record;
  copy_fields(agents, edit.slots[i], record.view(), 0);
#define X(name, type, per_agent, first, comment) \
  for (int k = 0; edit.name && k < (per_agent); ++k) record.name[k] = edit.name[i * (per_agent) + k];
  PICTURA_AGENT_FIELDS(X)
#undef X
  return record;
}

/// Fault in one 64-bit word, which a host can read atomically: field (or kNoSuchSlot or kSlotAgain), element and slot.
constexpr int64_t kNoEditFault = -1;
constexpr int32_t kNoSuchSlot = static_cast<int32_t>(AgentField::none), kSlotAgain = kNoSuchSlot + 1;
PICTURA_HD constexpr int64_t edit_fault(int32_t what, int32_t element, int32_t slot) {
  return (int64_t{what} << 56) | (int64_t{element} << 32) | static_cast<uint32_t>(slot);
}

PICTURA_HD inline bool has_slot(const StateEdit& edit, int i, int num_slots) {
  return edit.slots[i] >= 0 && edit.slots[i] < num_slots;
}

/// Returns the error of element i, or kNoEditFault. first_element [slots]: the first element of the edit that names
/// each slot. world_of(slot) must return the slot's WorldView.
template <typename WorldOf>
PICTURA_HD int64_t find_edit_fault(const StateEdit& edit, int i, int num_slots, const int32_t* first_element,
                                   const WorldOf& world_of) {
  const int32_t slot = edit.slots[i];
  if (!has_slot(edit, i, num_slots)) return edit_fault(kNoSuchSlot, i, slot);
  if (first_element[slot] != i) return edit_fault(kSlotAgain, i, slot);
  const WorldView world = world_of(slot);
  AgentRecord agent = edited_agent(world.agents, edit, i);
  const AgentField field = invalid_field(world.map, world.options, agent.view(), 0);
  return field == AgentField::none ? kNoEditFault : edit_fault(static_cast<int32_t>(field), i, slot);
}

/// Writes the agent of element i, which must be valid. Collisions between the old and the new place are not tested.
/// Returns the change in the number of agents in the episode.
PICTURA_HD inline int apply_edit(const WorldView& world, const StateEdit& edit, int i) {
  const AgentStateView& agents = world.agents;
  const int slot = edit.slots[i], agent = slot - world.first_slot;
  AgentRecord record = edited_agent(agents, edit, i);
  record.heading_rad[0] = wrap_angle(record.heading_rad[0]);
  const auto status = record.status[0];
  if (status == AgentStatus::active) record.halt_reason[0] = 0;
  const bool joins = has_body(status) && record.refusal[0] != SpawnFailure::none;
  if (joins) record.refusal[0] = SpawnFailure::none;
  copy_fields(record.view(), 0, agents, slot);
  store_motion(agents, slot, motion_of(agents, slot));
  if (has_body(status)) {
    store_fit(agents, slot,
              fit_agent(world, agent, {agents.x_m[slot], agents.y_m[slot]}, agents.z_m[slot], agents.heading_rad[slot],
                        agents.lane[slot], SingleThread{}));
  }
  world.boxes[agent] = world.boxes_before[agent] = box_of(agents, slot);
  return joins;
}

}  // namespace pictura
