// Names, types and shapes of agents' fields.
#pragma once

#include <string_view>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/common/error_types.h"
#include "pictura/simulator/state_edit.h"

namespace pictura {

struct AgentFieldInfo {
  std::string_view name;
  ElementType type;
  int per_agent = 1;
  std::string_view comment;
};

/// Descriptions of agent fields, in the order of AgentField.
constexpr AgentFieldInfo kAgentFields[] = {
#define X(name, type, per_agent, first, comment) {#name, element_type<type>(), per_agent, comment},
    PICTURA_AGENT_FIELDS(X)
#undef X
};

/// Whether the simulator computes a field from others. Simulator::set_state refuses such a field.
constexpr bool is_derived(AgentField field) {
  switch (field) {
    case AgentField::cos_heading:
    case AgentField::sin_heading:
    case AgentField::lane:
    case AgentField::lane_offset_m:
    case AgentField::lane_angle_rad:
    case AgentField::speed_limit_mps:
    case AgentField::refusal:
    case AgentField::life:
    case AgentField::life_step:
    case AgentField::left: return true;
    default: return false;
  }
}

/// Returns all fields as arrays [slots] or [slots, per agent].
std::vector<NamedArray> agent_state_arrays(const AgentStateView& state, int num_slots, Device device);

/// Returns the edit that these arrays describe. Throws Error as Simulator::set_state does, but does not check values.
StateEdit state_edit(const Array& slots, Span<const NamedArray> fields, int num_slots, Device device);

/// Formats values in host memory: "3", or "[1, 2, 3]" for several values.
std::string field_text(const AgentStateView& agents, int slot, AgentField field);

}  // namespace pictura
