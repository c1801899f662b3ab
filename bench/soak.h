// Long-running comparison of a renderer with the oracle, over scenes, views, rigs and settings drawn from a seed: of
// colours (u8, f16 and f32, planar), planes and visibility.
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
  int agents = 120, parked_cars = 32;  // maxima of a scene's world
  int views = 16;                      // per scene
  int64_t first_scene = 0;             // scenes are numbered from 0 and depend only on their number and the seed
  int64_t max_scenes = 0;              // 0: limited by time only
  double max_seconds = 480;
  uint64_t seed = 0;
  int num_threads = 0;  // 0: all
};

/// An image out of tolerance.
struct SoakFault {
  int64_t scene = 0;
  int view = 0, camera = 0;
  ImageError error;
};

/// A visibility that differs from the oracle's.
struct VisibilityFault {
  int64_t scene = 0;
  VisibilityQuery query;
  float answer = 0, expected = 0;
};

struct SoakResult {
  std::string choice;  // choice of the last renderer
  int64_t scenes = 0, images = 0, queries = 0;
  double seconds = 0;
  ImageError error;  // over all images
  int64_t images_out_of_tolerance = 0, differing_answers = 0;
  // The first hundred faults of each kind.
  std::vector<SoakFault> faults;
  std::vector<VisibilityFault> visibility_faults;
  int64_t first_faulty_scene = -1;
};

/// Function that makes the renderer to compare, once per scene, for host memory; may report how it was chosen.
using MakeRenderer = std::function<std::unique_ptr<Renderer>(const RendererConfig&, std::string* choice_out)>;

/// Compares scene by scene, and calls on_scene(result so far) after each scene. Throws Error naming the scene if making
/// a renderer or drawing fails, as for gl, which supports no planes, halves or visibility; passes on the UsageError of
/// `make`.
SoakResult soak(const SoakOptions& options, const MakeRenderer& make,
                const std::function<void(const SoakResult&)>& on_scene);

}  // namespace pictura
