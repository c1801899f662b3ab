// A film of one world: from above, with one agent's four cameras beneath.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

class Film {
 public:
  /// Opens the file; its format is that of its ending, .mp4 or .gif. From above it shows `width_m` metres around the
  /// agent, or with 0 the whole map. Throws Error naming the path.
  Film(const std::string& path, const Simulator& simulator, int agent, float width_m, int num_threads);
  ~Film();
  /// Adds the simulator's present state.
  void add_frame(Simulator& simulator);
  /// Completes the file; without it, nothing is left.
  void close();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
