// A film of one world: from above, with one agent's cameras beneath.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct FilmOptions {
  int agent = 0;        // that it follows
  float width_m = 150;  // that it shows from above around the agent; 0: the whole map
  /// What the images of a trained policy are drawn with; without it, the paper's cameras are shown.
  std::optional<RendererConfig> trained_view;
  int num_threads = 0;  // 0: all
};

/// Settings for pictures of a policy's cameras in a film: each as wide as the film's columns, and the least width of
/// lines in proportion, so that a line takes the part of the picture that it takes in the policy's image.
RendererConfig film_view(const RendererConfig& trained_view);

/// The cameras of a rig in the order in which a film shows them: from left to right, then those that look back.
std::vector<int> film_order(const Rig& rig);

class Film {
 public:
  /// Opens the file; its format is that of its ending, .mp4 or .gif. Throws Error naming the path.
  Film(const std::string& path, const Simulator& simulator, const FilmOptions& options);
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
