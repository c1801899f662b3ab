// Actions with which the simulator's dynamics follow a recording as closely as possible, and the remaining deviations.
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

/// Actions of every track: one action for each step of the record.
struct InverseActions {
  int32_t num_steps = 0;             // number of steps of the record from its start step on
  std::vector<int32_t> actions;      // [tracks, num_steps] kIdleAction in steps that are not followed
  std::vector<uint8_t> is_followed;  // [tracks, num_steps] 1: the states before and after the step are recorded
  std::vector<float> error_m;        // [tracks, num_steps] distance from the recorded position after the step
};

/// Finds the actions by a beam search, which keeps the best kBeamWidth sequences of actions. Each run of consecutive
/// recorded states is searched separately. A run starts from its first state, with accelerations and steering angle 0,
/// as agents that follow their record have in the simulator. The cost of a sequence is the sum of squared distances
/// from the recorded positions. Smaller costs of accelerations and of deviations in speed and heading prevent weaving.
/// The search ranks sequences by this cost plus the predicted cost of returning to the record from the sequence's end.
/// Multipliers of the dynamics are 1; `rules` must be those of the worlds in which the actions will be used. Throws
/// UsageError for a map without a record.
InverseActions find_inverse_actions(const CompiledMap& scene, float dt_s, int num_threads = 0,
                                    const DynamicsRules& rules = {});
constexpr int kBeamWidth = 48;

/// Inverse actions of all worlds of one simulator, in the form that TabledCommands reads.
struct InverseTable {
  /// Computes the actions. Throws UsageError if multipliers of the dynamics differ from 1, or if the map of a world has
  /// no record.
  explicit InverseTable(const Simulator& simulator);
  std::vector<ActionTable> worlds;
  std::vector<int32_t> actions;  // concatenated actions of all maps
};

/// Controller that replays inverse actions.
class InverseController final : public Controller {
 public:
  /// All worlds of the simulator must be recorded scenes.
  explicit InverseController(const Simulator& simulator) : table_(simulator) {}
  std::string_view name() const override { return "inverse"; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  const InverseTable table_;
};

}  // namespace pictura
