// Who drives in `render` and `simulate`: random actions, no action, or a saved policy, on one world of one map.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include <CLI/CLI.hpp>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Options that every command with a world shares.
struct WorldOptions {
  std::string map;
  int agents = 32;
  uint64_t seed = 0;
  int num_threads = 0;
  bool walls = true;
  bool vector_observations = true;
  // Where nothing is said, the pilot's world has them, or the paper's where the pilot knows none.
  std::optional<float> pedestrian_fraction, cyclist_fraction;
  std::optional<int> parked_cars;
};

/// Adds --agents, --pedestrians, --cyclists, --parked, --seed, --threads and --no-walls, which fill *options_out.
void add_world_options(CLI::App* command, WorldOptions* options_out);

/// Chooses the actions of all slots.
class Pilot {
 public:
  virtual ~Pilot() = default;
  /// Makes the world one that this pilot can drive in; does nothing for pilots that look at nothing.
  virtual void adapt(SimulatorConfig*) const {}
  /// Takes what the pilot needs of the world before its first act().
  virtual void enter(const Simulator&) {}
  virtual void act(Simulator& simulator, Span<int32_t> actions_out) = 0;
};

/// "random" (uniform, keyed by seed, slot and step), "idle" (no jerk), or a checkpoint's path (argmax; needs torch).
std::unique_ptr<Pilot> make_pilot(const std::string& name, uint64_t seed, const std::string& backend, int num_threads);

/// One world of options.agents agents on the map, at the start of its first episode, with evaluation's light timing,
/// which the pilot has entered.
std::unique_ptr<Simulator> make_world(const WorldOptions& options, Pilot* pilot);

}  // namespace pictura
