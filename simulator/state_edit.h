// New values of some fields of some agents, for Simulator::set_state().
#pragma once

#include "pictura/simulator/fields.h"

namespace pictura {

enum class AgentField : int32_t {
#define X(name, type, per_agent, first, comment) name,
  PICTURA_AGENT_FIELDS(X)
#undef X
      none
};

struct StateEdit {
  int32_t count = 0;
  const int32_t* slots = nullptr;  // [count]
// New values [count, per agent]. The field of a null pointer stays unchanged.
#define X(name, type, per_agent, first, comment) const type* name = nullptr;
  PICTURA_AGENT_FIELDS(X)
#undef X
};

}  // namespace pictura
