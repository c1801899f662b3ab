// Errors of the CPU renderer and of simpler methods against the truth (the ray caster of bench/truth/image_truth.h).
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
  int steps = 30;  // random actions
  int views = 8;
  bool walls = true;
  int num_threads = 0;  // 0: all
};

/// Drives a world with random actions. The views are evenly spaced in the list of all spawned agents' views. A tenth of
/// the agents are cyclists, and a tenth pedestrians. Throws Error if the map cannot be read or no agent can be spawned.
Snapshot drive_snapshot(const SnapshotOptions& options);

/// Errors against the truth, pooled over all images that are not blank.
struct Quality {
  PooledError one_sample;                                           // z-buffer, one sample at the pixel's centre
  PooledError grid_2x2;                                             // z-buffer, 2x2 samples per pixel
  PooledError area;                                                 // exact coverage as alpha, front to back
  PooledError oracle;                                               // the CPU renderer
  PooledError oracle_bytes;                                         // the oracle, rounded to bytes
  double worst_image_db = std::numeric_limits<double>::infinity();  // lowest PSNR of an oracle image
  int images = 0;

  void add(const Quality& other);
};

/// Draws all views with config.rig, and measures the errors.
Quality measure_quality(const StaticGeometry& geometry, const SceneBatch& scene, Span<const View> views,
                        const RendererConfig& config);

/// Error of the CPU renderer against the truth.
PooledError measure_random_scene(RandomKind kind, uint64_t seed);

/// Writes a picture with a row per snapshot: a crop of its first image, where the simpler methods have the largest
/// error. Columns: truth, CPU renderer, area coverage, 2x2 samples, one sample.
void write_quality_figure(const std::string& path, Span<const Snapshot> snapshots, const RendererConfig& config);

}  // namespace pictura
