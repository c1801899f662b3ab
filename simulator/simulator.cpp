#include "pictura/simulator/simulator.h"

#include "pictura/common/error.h"
#include "pictura/simulator/agent_state_arrays.h"
#include "pictura/simulator/rules/observe_query.h"

namespace pictura {
namespace {

/// Checks an output array of observe(). Throws Error unless it has num_queries * rows * features values (none if
/// `is_observed` is false) and, on a device, begins at a multiple of 16 bytes.
template <typename T>
void check_observed(std::string_view name, Span<T> values, bool is_observed, size_t num_queries, int rows, int features,
                    Device device) {
  PICTURA_CHECK(is_observed || values.empty(),
                "observe: out: {}: expected no values, since this simulator does not observe it, got {}", name,
                values.size());
  if (!is_observed) return;
  const auto per_query = static_cast<size_t>(rows * features);
  PICTURA_CHECK(values.size() == num_queries * per_query, "observe: out: {}: expected [{}, {}, {}], {} values, got {}",
                name, num_queries, rows, features, num_queries * per_query, values.size());
  constexpr size_t kAtOnce = 4;
  const bool is_aligned = reinterpret_cast<uintptr_t>(values.data()) % (kAtOnce * sizeof(T)) == 0;
  PICTURA_CHECK(device.is_host() || per_query % kAtOnce != 0 || is_aligned,
                "observe: out: {}: expected an address that is a multiple of {} bytes", name, kAtOnce * sizeof(T));
}

}  // namespace

StepResult Simulator::step(const Array& actions, Stream stream) {
  return step_actions(actions.checked<const int32_t>("step: actions", {num_slots()}, device()), stream);
}

void Simulator::reset(const Array& world_mask, uint64_t seed, Stream stream) {
  const auto num_worlds = static_cast<int64_t>(worlds().size());
  reset_worlds(world_mask.checked<const uint8_t>("reset: world_mask", {num_worlds}, device()), seed, stream);
}

void Simulator::set_state(const Array& slots, Span<const NamedArray> fields, Stream stream) {
  apply_edit(state_edit(slots, fields, num_slots(), device()), stream);
}

void Simulator::observe(Span<const ObservationQuery> queries, Span<const int32_t> hidden,
                        Span<const InsertedBox> inserted, const ObservationView& out, Stream stream) {
  PICTURA_CHECK(queries.size() <= kMaxQueries, "observe: expected at most {} queries, got {}", kMaxQueries,
                queries.size());
#define X(name, type, rows, features, part, comment) \
  check_observed(#name, out.name, config().observes(part), queries.size(), rows, features, device());
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  answer_queries({queries, hidden, inserted, out}, stream);
}

StepResult Simulator::step(Span<const Command> commands, Stream stream) {
  PICTURA_CHECK(commands.size() == static_cast<size_t>(num_slots()), "step: expected {} commands, got {}", num_slots(),
                commands.size());
  return step_commands(commands, stream);
}

}  // namespace pictura
