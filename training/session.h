// A saved policy, without torch headers.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// A trained policy that chooses actions for every slot of a simulator.
class Driver {
 public:
  virtual ~Driver() = default;
  /// Whether it needs images; then `renderer` below must have been made with rig().
  virtual bool needs_images() const = 0;
  virtual const Rig& rig() const = 0;
  /// The world that the policy is evaluated in: fixed conditioning and lights, the observations that it was trained on.
  virtual SimulatorConfig evaluation_world() const = 0;
  /// Fills actions_out [slots] from the simulator's present observations and, where needed, images drawn by `renderer`,
  /// which holds the simulator's geometries. argmax, or a draw from the policy (keyed as in training).
  virtual void act(Simulator& simulator, Renderer* renderer, bool argmax, Span<int32_t> actions_out) = 0;
};

/// Throws Error naming the file when it is no checkpoint, truncated, or of another observation schema.
std::unique_ptr<Driver> load_driver(const std::string& checkpoint_path, int num_threads);

}  // namespace pictura
