// Film of one simulated world: a view from above, and below it the camera images of one agent.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct FilmOptions {
  int agent = 0;        // agent that the film follows
  float width_m = 150;  // width of the view from above around the agent; 0: the whole map
  /// Settings of the images that a trained policy observes. By default, the film shows the four cameras of paper_rig().
  std::optional<RendererConfig> trained_view;
  int num_threads = 0;  // 0: all
};

/// Settings with which a film draws the images of a policy's cameras. Each picture is as wide as the film's columns.
/// The minimum width of lines is scaled with the image, so that a line covers equal shares of the picture and of the
/// policy's image.
RendererConfig film_view(const RendererConfig& trained_view);

/// Order of a rig's cameras in a film: cameras from left to right, then cameras that face backwards.
std::vector<int> film_order(const Rig& rig);

class Film {
 public:
  /// Opens the file. The file name's ending selects the format, .mp4 or .gif. Throws Error naming the path.
  Film(const std::string& path, const Simulator& simulator, const FilmOptions& options);
  ~Film();
  /// Adds the simulator's current state.
  void add_frame(Simulator& simulator);
  /// Completes the file; without this call, no file remains.
  void close();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
