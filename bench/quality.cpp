#include "pictura/bench/quality.h"

#include <algorithm>
#include <cmath>
#include <utility>

#include "pictura/backend_cpu/renderer/image_drawer.h"
#include "pictura/bench/driving.h"
#include "pictura/common/raster/check.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/parallel_for.h"

namespace pictura {

Snapshot drive_snapshot(const SnapshotOptions& options) {
  DrivenWorlds worlds =
      drive_worlds({.maps = {options.map},
                    .agents = options.agents,
                    .steps = options.steps,
                    .simulator = {.seed = options.seed, .num_threads = options.num_threads, .walls = options.walls}});
  const SceneBatch scene = worlds.simulator->scene();
  Snapshot snapshot;
  snapshot.geometry = worlds.simulator->maps()[0]->geometry;
  snapshot.scene.agents.assign(scene.agents.begin(), scene.agents.end());
  snapshot.scene.light_states.assign(scene.light_states.begin(), scene.light_states.end());
  snapshot.scene.end_world(0);
  const std::vector<View>& views = worlds.views;
  const auto wanted = std::min(static_cast<std::size_t>(options.views), views.size());
  for (std::size_t i = 0; i < wanted; ++i) snapshot.views.push_back(views[i * views.size() / wanted]);
  return snapshot;
}

void Quality::add(const Quality& other) {
  one_sample.add(other.one_sample);
  grid_2x2.add(other.grid_2x2);
  area.add(other.area);
  oracle.add(other.oracle);
  oracle_bytes.add(other.oracle_bytes);
  worst_image_db = std::min(worst_image_db, other.worst_image_db);
  images += other.images;
}

namespace {

// One image drawn by each method, as [3, height, width] in [0, 1].
struct MethodImages {
  TruthImage truth;
  std::vector<float> one_sample, grid_2x2, area, oracle;
};

// Composites exact coverage as alpha: each face takes the share of the remaining pixel that equals its area.
std::vector<float> composite_areas(ImageDrawer* drawer, std::size_t pixels) {
  std::vector<float> rgb(3 * pixels), left(pixels, 1.0f);
  drawer->visit_fragments([&](int pixel, const PixelCoverage& coverage, Rgb color) {
    const auto i = static_cast<std::size_t>(pixel);
    const float weight = coverage.area * left[i];
    left[i] -= weight;
    rgb[i] += weight * color.r;
    rgb[i + pixels] += weight * color.g;
    rgb[i + 2 * pixels] += weight * color.b;
  });
  return rgb;
}

// Returns an ImageDrawer that is prepared to draw one image as the CPU renderer does.
ImageDrawer prepared_drawer(const CulledGeometry& pieces, const SceneBatch& scene, const View& view,
                            const Camera& camera, float line_floor_px) {
  Rig rig;
  rig.cameras = {camera};
  ImageDrawer drawer;
  drawer.prepare({&pieces, &scene, &view, place_camera(pinhole_cameras(rig)[0], view), line_floor_px, false});
  return drawer;
}

MethodImages draw_all_methods(const StaticGeometry& geometry, const SceneBatch& scene, const View& view,
                              const Camera& camera, float line_floor_px) {
  auto trace = [&](TruthSamples samples) { return trace_image(geometry, scene, view, camera, line_floor_px, samples); };
  MethodImages drawn{trace(TruthSamples::low_discrepancy_1024),
                     trace(TruthSamples::center).rgb,
                     trace(TruthSamples::grid_2x2).rgb,
                     {},
                     {}};
  const CulledGeometry pieces(geometry.view());
  const auto pixels = static_cast<std::size_t>(camera.width_px) * static_cast<std::size_t>(camera.height_px);
  ImageDrawer drawer = prepared_drawer(pieces, scene, view, camera, line_floor_px);
  drawn.oracle.resize(3 * pixels);
  drawer.draw({PixelFormat::f32, drawn.oracle.data()});
  drawn.area = composite_areas(&drawer, pixels);
  return drawn;
}

}  // namespace

Quality measure_quality(const StaticGeometry& geometry, const SceneBatch& scene, Span<const View> views,
                        const RendererConfig& config) {
  const std::size_t cameras = config.rig.cameras.size(), images = views.size() * cameras;
  std::vector<MethodImages> drawn(images);
  parallel_for(resolve_num_threads(config.num_threads), static_cast<int64_t>(images), [&](int64_t i) {
    throw_if_interrupted();
    const auto image = static_cast<std::size_t>(i);
    drawn[image] = draw_all_methods(geometry, scene, views[image / cameras], config.rig.cameras[image % cameras],
                                    config.line_floor_px);
  });
  Quality quality;
  for (const MethodImages& image : drawn) {
    if (image.truth.blank()) continue;
    const std::vector<float>& truth = image.truth.rgb;
    std::vector<float> bytes = image.oracle;
    for (float& channel : bytes) channel = static_cast<float>(to_byte(channel)) / 255.0f;
    quality.one_sample.add(image.one_sample, truth);
    quality.grid_2x2.add(image.grid_2x2, truth);
    quality.area.add(image.area, truth);
    quality.oracle.add(image.oracle, truth);
    quality.oracle_bytes.add(bytes, truth);
    quality.worst_image_db = std::min(quality.worst_image_db, PooledError(image.oracle, truth).psnr_db());
    ++quality.images;
  }
  return quality;
}

PooledError measure_random_scene(RandomKind kind, uint64_t seed) {
  const auto [town, config] = make_random_scene(kind, seed);
  const SceneBatch scene = town.scene.batch();
  const View& view = town.views.at(0);
  const Camera& camera = config.rig.cameras.at(0);
  const TruthImage truth = trace_image(town.geometry, scene, view, camera, config.line_floor_px);
  const CulledGeometry pieces(town.geometry.view());
  std::vector<float> oracle(truth.rgb.size());
  prepared_drawer(pieces, scene, view, camera, config.line_floor_px).draw({PixelFormat::f32, oracle.data()});
  return {oracle, truth.rgb};
}

namespace {

constexpr int kCropWidth_px = 32, kCropHeight_px = 18, kZoom = 8, kGap_px = 4;

// Returns the top left corner of the crop in which the sum of the errors of area coverage and of 2x2 samples is
// largest.
std::pair<int, int> worst_crop(const MethodImages& drawn, int width, int height) {
  const int crop_width = std::min(kCropWidth_px, width), crop_height = std::min(kCropHeight_px, height);
  std::pair<int, int> worst{0, 0};
  double worst_error = -1;
  for (int y0 = 0; y0 + crop_height <= height; y0 += 2) {
    for (int x0 = 0; x0 + crop_width <= width; x0 += 2) {
      double error = 0;
      for (int channel = 0; channel < 3; ++channel) {
        for (int y = y0; y < y0 + crop_height; ++y) {
          for (int x = x0; x < x0 + crop_width; ++x) {
            const auto i = static_cast<std::size_t>((channel * height + y) * width + x);
            error += std::abs(drawn.area[i] - drawn.truth.rgb[i]) + std::abs(drawn.grid_2x2[i] - drawn.truth.rgb[i]);
          }
        }
      }
      if (error > worst_error) worst_error = error, worst = {x0, y0};
    }
  }
  return worst;
}

}  // namespace

void write_quality_figure(const std::string& path, Span<const Snapshot> snapshots, const RendererConfig& config) {
  const Camera& camera = config.rig.cameras.at(0);
  const int crop_width = std::min(kCropWidth_px, camera.width_px);
  const int crop_height = std::min(kCropHeight_px, camera.height_px);
  constexpr int kColumns = 5;
  const int rows = static_cast<int>(snapshots.size());
  const int width = kColumns * (crop_width * kZoom + kGap_px) - kGap_px;
  const int height = rows * (crop_height * kZoom + kGap_px) - kGap_px;
  // The space between the crops is white, because the background of the images is black.
  std::vector<uint8_t> sheet(static_cast<std::size_t>(3 * width) * static_cast<std::size_t>(height), 255);
  for (int row = 0; row < rows; ++row) {
    const Snapshot& snapshot = snapshots[row];
    const MethodImages drawn =
        draw_all_methods(snapshot.geometry, snapshot.scene.batch(), snapshot.views.at(0), camera, config.line_floor_px);
    const auto [x0, y0] = worst_crop(drawn, camera.width_px, camera.height_px);
    const std::vector<float>* images[kColumns] = {&drawn.truth.rgb, &drawn.oracle, &drawn.area, &drawn.grid_2x2,
                                                  &drawn.one_sample};
    for (int column = 0; column < kColumns; ++column) {
      for (int y = 0; y < crop_height * kZoom; ++y) {
        for (int x = 0; x < crop_width * kZoom; ++x) {
          for (int channel = 0; channel < 3; ++channel) {
            const int from = (channel * camera.height_px + y0 + y / kZoom) * camera.width_px + x0 + x / kZoom;
            const int to_x = column * (crop_width * kZoom + kGap_px) + x;
            const int to_y = row * (crop_height * kZoom + kGap_px) + y;
            sheet[3 * (to_y * width + to_x) + channel] = to_byte((*images[column])[from]);
          }
        }
      }
    }
  }
  write_png(path, width, height, sheet);
}

}  // namespace pictura
