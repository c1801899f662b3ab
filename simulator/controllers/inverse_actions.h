// Actions by which the simulator's dynamics follow a recording most closely, and their deviation from it.
#pragma once

#include <cstdint>
#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/rules/control.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Actions of every track, for the steps after each state of its record.
struct InverseActions {
  int32_t num_steps = 0;             // steps of the record from its start step
  std::vector<int32_t> actions;      // [tracks, num_steps] idle where there is no state to follow
  std::vector<uint8_t> is_followed;  // [tracks, num_steps] whether both the start state and the target state exist
  std::vector<float> error_m;        // [tracks, num_steps] distance from the recorded place after the action
};

/// Searches each unbroken run of valid states separately, from its first state, with accelerations and steering angle
/// 0, as a takeover starts. A beam search keeps the best kBeamWidth sequences of actions. The cost of a sequence sums
/// the squared distance from the recorded places, a small cost for deviations of speed and heading, and the predicted
/// cost of returning to the record from the last motion. Without the small cost the path would weave. Multipliers of
/// the dynamics are 1, and `rules` are those of the worlds in which the actions are taken. Throws UsageError for a map
/// without a record.
InverseActions find_inverse_actions(const CompiledMap& scene, float dt_s, int num_threads = 0,
                                    const DynamicsRules& rules = {});
constexpr int kBeamWidth = 48;

/// Inverse actions of all worlds of one simulator, as TabledCommands reads them.
struct InverseTable {
  /// Throws UsageError if multipliers of the dynamics differ from 1, and for worlds without a record.
  explicit InverseTable(const Simulator& simulator);
  std::vector<ActionTable> worlds;
  std::vector<int32_t> actions;  // actions of all maps in sequence
};

/// Controller that replays inverse actions.
class InverseController final : public Controller {
 public:
  /// For one simulator, whose worlds are all recorded scenes.
  explicit InverseController(const Simulator& simulator) : table_(simulator) {}
  std::string_view name() const override { return "inverse"; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  const InverseTable table_;
};

}  // namespace pictura
