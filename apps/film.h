// A film of one world: from above, following one agent, with that agent's four cameras beneath.
#pragma once

#include <memory>
#include <string>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

class Film {
 public:
  /// Opens the file; its format is that of its ending, .mp4 or .gif. Throws Error naming the path.
  Film(const std::string& path, const Simulator& simulator, int agent, int num_threads);
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
