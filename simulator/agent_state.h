// Fields of all agents (fields.h), in host memory.
#pragma once

#include <vector>

#include "pictura/common/support/hash.h"
#include "pictura/simulator/fields.h"

namespace pictura {

struct AgentState {
#define X(name, type, per_agent, first, comment) std::vector<type> name;
  PICTURA_AGENT_FIELDS(X)
#undef X

  /// Sets initial values.
  explicit AgentState(size_t num_agents = 0) { resize(num_agents); }
  void resize(size_t num_agents);
  void reserve(size_t num_agents);
  AgentStateView view();
  /// In the following functions, `with_lives` includes the fields of lives. Bytes are in the order of fields.h.
  void add_to(Hash64* hash_inout, bool with_lives) const;
  size_t size_bytes(bool with_lives) const;
  void copy_to(uint8_t* bytes_out, bool with_lives) const;
  /// Reads bytes that copy_to() wrote for the same number of agents.
  void assign_from(const uint8_t* bytes, bool with_lives);
};

}  // namespace pictura
