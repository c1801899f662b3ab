#include "pictura/simulator/agent_state.h"

#include <cstring>

namespace pictura {

void AgentState::resize(size_t num_agents) {
#define X(name, type, per_agent, first, comment) name.assign(num_agents*(per_agent), static_cast<type>(first));
  PICTURA_AGENT_FIELDS(X)
#undef X
}

void AgentState::reserve(size_t num_agents){
#define X(name, type, per_agent, first, comment) name.reserve(num_agents*(per_agent));
    PICTURA_AGENT_FIELDS(X)
#undef X
}

AgentStateView AgentState::view() {
#define X(name, type, per_agent, first, comment) .name = name.data(),
  return {PICTURA_AGENT_FIELDS(X)};
#undef X
}

void AgentState::add_to(Hash64* hash_inout, bool with_lives) const {
#define X(name, type, per_agent, first, comment) hash_inout->add(Span<const type>(name));
  PICTURA_EPISODE_FIELDS(X)
  if (!with_lives) return;
  PICTURA_LIFE_FIELDS(X)
#undef X
}

size_t AgentState::size_bytes(bool with_lives) const {
  size_t size = 0;
#define X(name, type, per_agent, first, comment) size += name.size() * sizeof(type);
  PICTURA_EPISODE_FIELDS(X)
  if (!with_lives) return size;
  PICTURA_LIFE_FIELDS(X)
#undef X
  return size;
}

void AgentState::copy_to(uint8_t* bytes_out, bool with_lives) const {
#define X(name, type, per_agent, first, comment)                   \
  std::memcpy(bytes_out, name.data(), name.size() * sizeof(type)); \
  bytes_out += name.size() * sizeof(type);
  PICTURA_EPISODE_FIELDS(X)
  if (!with_lives) return;
  PICTURA_LIFE_FIELDS(X)
#undef X
}

void AgentState::assign_from(const uint8_t* bytes, bool with_lives) {
#define X(name, type, per_agent, first, comment)               \
  std::memcpy(name.data(), bytes, name.size() * sizeof(type)); \
  bytes += name.size() * sizeof(type);
  PICTURA_EPISODE_FIELDS(X)
  if (!with_lives) return;
  PICTURA_LIFE_FIELDS(X)
#undef X
}

}  // namespace pictura
