// Errors of images against the truth (the images of the ray caster in bench/truth/image_truth.h). They are measured for
// the CPU renderer and for simpler methods. `pictura bench quality` and tests use this header; it is not installed.
#pragma once

#include <limits>
#include <string>
#include <vector>

#include "pictura/bench/truth/image_scenes.h"
#include "pictura/bench/truth/image_truth.h"
#include "pictura/bench/truth/random_scenes.h"

namespace pictura {

struct SnapshotOptions {
  std::string map = "procedural:1";
  int agents = 120;
  uint64_t seed = 0;
  int steps = 30;  // number of random actions
  int views = 8;
  bool walls = true;
  int num_threads = 0;  // 0: all
};

/// Drives a world with random actions. The views are those of spawned agents, chosen at even intervals. One agent in
/// ten is a cyclist, and one in ten is a pedestrian. Throws Error if the map cannot be read or no agent can be spawned.
Snapshot drive_snapshot(const SnapshotOptions& options);

/// Errors of the methods against the truth, pooled over all images that are not blank.
struct Quality {
  PooledError one_sample;                                           // a z-buffer with one sample at the pixel's centre
  PooledError grid_2x2;                                             // a z-buffer with 2x2 samples per pixel
  PooledError area;                                                 // exact coverage as alpha, front to back
  PooledError oracle;                                               // the CPU renderer
  PooledError oracle_bytes;                                         // the CPU renderer, rounded to bytes
  double worst_image_db = std::numeric_limits<double>::infinity();  // lowest PSNR of one image of the CPU renderer
  int images = 0;

  void add(const Quality& other);
};

/// Draws all views with all cameras of config.rig, on config.num_threads threads, and measures the errors.
Quality measure_quality(const StaticGeometry& geometry, const SceneBatch& scene, Span<const View> views,
                        const RendererConfig& config);

/// Error of the CPU renderer against the truth in one random scene.
PooledError measure_random_scene(RandomKind kind, uint64_t seed);

/// Writes one picture with a row for each snapshot. A row shows a crop of the snapshot's first view and first camera,
/// at the place where the simpler methods have the largest error. Its columns are the truth, the oracle (the CPU
/// renderer), area coverage, 2x2 samples and one sample, enlarged without smoothing.
void write_quality_figure(const std::string& path, Span<const Snapshot> snapshots, const RendererConfig& config);

}  // namespace pictura
