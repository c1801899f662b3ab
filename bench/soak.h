// Long-running comparison of a renderer with the oracle (the CPU renderer) in random scenes: colours (u8, f16 and f32,
// planar), planes and visibility.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/bench/image_error.h"
#include "pictura/common/renderer.h"

namespace pictura {

struct SoakOptions {
  std::vector<std::string> maps;
  int agents = 120, parked_cars = 32;  // maxima in a scene
  int views = 16;                      // views per scene
  int64_t first_scene = 0;             // a scene depends only on its number and the seed
  int64_t max_scenes = 0;              // 0: only time is limited
  double max_seconds = 480;
  uint64_t seed = 0;
  int num_threads = 0;  // 0: all
};

struct SoakFault {
  int64_t scene = 0;
  int view = 0, camera = 0;
  ImageError error;
};

struct VisibilityFault {
  int64_t scene = 0;
  VisibilityQuery query;
  float answer = 0, expected = 0;
};

struct SoakResult {
  std::string choice;  // see MakeRenderer
  int64_t scenes = 0, images = 0, queries = 0;
  double seconds = 0;
  ImageError error;  // summed over all images
  int64_t images_out_of_tolerance = 0, differing_answers = 0;
  // The first hundred faults of each kind.
  std::vector<SoakFault> faults;
  std::vector<VisibilityFault> visibility_faults;
  int64_t first_faulty_scene = -1;
};

/// Makes the compared renderer, once per scene.
using MakeRenderer = std::function<std::unique_ptr<Renderer>(const RendererConfig&, std::string* choice_out)>;

/// Calls on_scene(result so far) after each scene. If a renderer cannot be made or drawing fails, throws an Error that
/// names the scene. Throws the UsageErrors of `make` unchanged.
SoakResult soak(const SoakOptions& options, const MakeRenderer& make,
                const std::function<void(const SoakResult&)>& on_scene);

}  // namespace pictura
