// The actions by which the simulator's dynamics follow a recording most closely, and how closely that is.
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

/// Of every track, for the steps after each state of its record.
struct InverseActions {
  int32_t num_steps = 0;             // of the record, from its start step
  std::vector<int32_t> actions;      // [tracks, num_steps] idle where there is nothing to follow
  std::vector<uint8_t> is_followed;  // [tracks, num_steps] whether there is a state to start from and one to reach
  std::vector<float> error_m;        // [tracks, num_steps] from the recorded place, after that action
};

/// Searches each unbroken run of valid states by itself, from the first one, with accelerations and steering angle 0,
/// as a takeover starts. A beam search keeps the best kBeamWidth sequences of actions; it pays for squared distances
/// from the recorded places, a little for speeds and headings that are not the recorded ones, without which it would
/// weave, and for the way back to the record that its last motion leaves. Multipliers of the dynamics are 1, and
/// `rules` are those of the worlds in which the actions are taken. Throws UsageError for a map without a record.
InverseActions find_inverse_actions(const CompiledMap& scene, float dt_s, int num_threads = 0,
                                    const DynamicsRules& rules = {});
constexpr int kBeamWidth = 48;

/// Those of all worlds of one simulator, as TabledCommands reads them.
struct InverseTable {
  /// Throws UsageError where multipliers of the dynamics are not 1, and for worlds without a record.
  explicit InverseTable(const Simulator& simulator);
  std::vector<ActionTable> worlds;
  std::vector<int32_t> actions;  // of one map after the other
};

/// Drives by them.
class InverseController final : public Controller {
 public:
  /// Of one simulator, whose worlds are all recorded scenes.
  explicit InverseController(const Simulator& simulator) : table_(simulator) {}
  std::string_view name() const override { return "inverse"; }
  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out,
           Stream stream = {}) override;

 private:
  const InverseTable table_;
};

}  // namespace pictura
