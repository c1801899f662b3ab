// Film of one simulated world: a view from above, and the camera images of one agent below it.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct FilmOptions {
  int agent = 0;        // followed agent; while it is absent, its images are black
  float width_m = 150;  // width of the view around the agent; 0: the whole map
  /// Settings of the policy's images. Default: the cameras of paper_rig().
  std::optional<RendererConfig> trained_view;
  int num_threads = 0;  // 0: all
};

/// Returns settings for drawing a policy's images at the width of the film's columns. The minimum line width is scaled
/// with the image.
RendererConfig film_view(const RendererConfig& trained_view);

/// Returns the rig's cameras from left to right, then those that face backwards.
std::vector<int> film_order(const Rig& rig);

class Film {
 public:
  /// The path's ending selects the format, .mp4 or .gif. Throws Error naming the path.
  Film(const std::string& path, const Simulator& simulator, const FilmOptions& options);
  ~Film();
  void add_frame(Simulator& simulator);
  /// Completes the file; without this call, no file remains.
  void close();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
