// Errors of images against the truth (the ray caster of bench/truth/image_truth.h), for the CPU renderer and for
// simpler methods. Used by `pictura bench quality` and by tests; not installed.
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

/// Drives a world with random actions; its views are an even selection of the spawned agents. One agent in ten is a
/// cyclist, and one in ten is a pedestrian. Throws Error if the map cannot be read or no agent can be spawned.
Snapshot drive_snapshot(const SnapshotOptions& options);

/// Error against the truth, pooled over the images that are not blank.
struct Quality {
  PooledError one_sample;                                           // a z-buffer, at the pixel's centre
  PooledError grid_2x2;                                             // one sample with 2x2 supersampling
  PooledError area;                                                 // exact coverage as alpha, front to back
  PooledError oracle;                                               // the CPU renderer
  PooledError oracle_bytes;                                         // the CPU renderer, rounded to bytes
  double worst_image_db = std::numeric_limits<double>::infinity();  // worst PSNR of an image of the oracle
  int images = 0;

  void add(const Quality& other);
};

/// Draws all views with every camera of config.rig, on config.num_threads threads.
Quality measure_quality(const StaticGeometry& geometry, const SceneBatch& scene, Span<const View> views,
                        const RendererConfig& config);

/// Error of the CPU renderer against the truth in one random scene.
PooledError measure_random_scene(RandomKind kind, uint64_t seed);

/// Writes one picture with a row for each snapshot. The row shows a crop of the first camera of its first view, where
/// the simpler methods have the largest error: the truth, the oracle, area coverage, 2x2 samples and one sample,
/// enlarged without smoothing.
void write_quality_figure(const std::string& path, Span<const Snapshot> snapshots, const RendererConfig& config);

}  // namespace pictura
