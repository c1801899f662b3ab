// Actions with which the dynamics follow a recording closely.
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

/// Actions and deviations of all tracks.
struct InverseActions {
  int32_t num_steps = 0;             // from the start step on
  std::vector<int32_t> actions;      // [tracks, num_steps] kIdleAction if not followed
  std::vector<uint8_t> is_followed;  // [tracks, num_steps] 1: states before and after the step are recorded
  std::vector<float> error_m;        // [tracks, num_steps] distance from the recorded position after the step
};

/// Finds the actions by a beam search, which keeps the best kBeamWidth sequences. Each run of consecutive recorded
/// states starts with accelerations and steering angle 0. The cost is mainly the sum of squared distances from recorded
/// positions. Multipliers of the dynamics are 1. `rules` must be those of the worlds that use the actions. Throws
/// UsageError for a map without a record.
InverseActions find_inverse_actions(const CompiledMap& scene, float dt_s, int num_threads = 0,
                                    const DynamicsRules& rules = {});
constexpr int kBeamWidth = 48;

/// Inverse actions of all worlds of a simulator, for TabledCommands.
struct InverseTable {
  /// Throws UsageError if a multiplier of the dynamics differs from 1, or if a world's map has no record.
  explicit InverseTable(const Simulator& simulator);
  std::vector<ActionTable> worlds;
  std::vector<int32_t> actions;  // concatenated for all maps
};

/// Replays inverse actions.
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
