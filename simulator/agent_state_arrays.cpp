#include "pictura/simulator/agent_state_arrays.h"

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/suggestion.h"

namespace pictura {
namespace {

Dims dims_of(int count, int per_agent) { return per_agent == 1 ? Dims{count} : Dims{count, per_agent}; }

AgentField field_of(std::string_view name) {
  std::vector<std::string> known;
  for (size_t i = 0; i < std::size(kAgentFields); ++i) {
    if (kAgentFields[i].name == name) return static_cast<AgentField>(i);
    known.emplace_back(kAgentFields[i].name);
  }
  fail("set_state: expected names of an agent's fields, got '{}'{}", name, suggestion(name, known));
}

}  // namespace

std::vector<NamedArray> agent_state_arrays(const AgentStateView& state, int num_slots, Device device) {
  std::vector<NamedArray> arrays;
#define X(name, type, per_agent, first, comment) \
  arrays.push_back({#name, Array(state.name, dims_of(num_slots, per_agent), device)});
  PICTURA_AGENT_FIELDS(X)
#undef X
  return arrays;
}

StateEdit state_edit(const Array& slots, Span<const NamedArray> fields, int num_slots, Device device) {
  StateEdit edit;
  const int64_t count = slots.shape.rank() == 1 ? slots.shape[0] : 0;
  PICTURA_CHECK(count <= num_slots, "set_state: slots: expected at most {} distinct slots, got {}", num_slots, count);
  edit.count = static_cast<int32_t>(count);
  edit.slots = slots.checked<const int32_t>("set_state: slots", {count}, device).data();
  for (const NamedArray& given : fields) {
    const AgentField field = field_of(given.name);
    PICTURA_CHECK(!is_derived(field), "set_state: {}: follows from other fields and cannot be set", given.name);
    const std::string what = fmt::format("set_state: {}", given.name);
    switch (field) {
#define X(name_, type, per_agent, first, comment)                                                                   \
  case AgentField::name_:                                                                                           \
    PICTURA_CHECK(!edit.name_, "{}: expected each field once", what);                                               \
    edit.name_ = given.array.checked<const type>(what, dims_of(static_cast<int>(count), per_agent), device).data(); \
    break;
      PICTURA_AGENT_FIELDS(X)
#undef X
      case AgentField::none: break;
    }
  }
  return edit;
}

std::string field_text(const AgentStateView& agents, int slot, AgentField field) {
  const auto text = [slot]<typename T>(const T* values, int per_agent) {
    const auto* const own = reinterpret_cast<const StoredAs<T>*>(values) + int64_t{slot} * per_agent;
    return per_agent == 1 ? fmt::format("{}", *own) : fmt::format("[{}]", fmt::join(own, own + per_agent, ", "));
  };
  switch (field) {
#define X(name, type, per_agent, first, comment) \
  case AgentField::name: return text(agents.name, per_agent);
    PICTURA_AGENT_FIELDS(X)
#undef X
    default: return "";
  }
}

}  // namespace pictura
