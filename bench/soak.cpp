#include "pictura/bench/soak.h"

#include <chrono>

#include "pictura/bench/driving.h"
#include "pictura/common/error.h"
#include "pictura/common/interrupt.h"
#include "pictura/common/make_renderer.h"
#include "pictura/common/rng.h"
#include "pictura/map/load_map.h"

namespace pictura {

namespace {

constexpr std::size_t kMostFaults = 100;

RandomStream random_of(const SoakOptions& options, int64_t scene, uint32_t what) {
  return {options.seed, what, 0, static_cast<uint32_t>(scene >> 32), static_cast<uint32_t>(scene), Purpose::soak};
}

// Rigs are few, because kernels are built for each: the paper's, and three of cameras of odd sizes.
std::vector<Rig> draw_rigs(const SoakOptions& options) {
  std::vector<Rig> rigs{paper_rig()};
  RandomStream random = random_of(options, 0, 0);
  while (rigs.size() < 4) {
    Rig rig = paper_rig();
    rig.cameras.resize(static_cast<std::size_t>(1 + random.below(4)));
    for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
      const int width_px = 1 + random.below(220), height_px = 1 + random.below(130);
      rig.cameras[k] = paper_rig(width_px, height_px).cameras[k];
    }
    rigs.push_back(rig);
  }
  return rigs;
}

// A world of one of the maps, driven anew for each scene: its number says which and for how long, so that a scene can
// be drawn again without those before it.
class Scenes {
 public:
  explicit Scenes(const SoakOptions& options) : options_(options) {
    for (const std::string& map : options.maps) maps_.push_back(load_map(map));
  }

  void drive(int64_t scene) {
    RandomStream random = random_of(options_, scene, 1);
    SimulatorConfig config;
    config.seed = random.bits();
    config.num_threads = options_.num_threads;
    config.parked_cars = options_.parked_cars;
    config.walls = random.below(4) > 0;
    config.vector_observations = false;
    const auto map = static_cast<std::size_t>(random.below(static_cast<int>(maps_.size())));
    const WorldSpec world{0, 1 + random.below(options_.agents), static_cast<uint32_t>(scene)};
    simulator_ = make_simulator("cpu", config, {maps_[map]}, {world});
    drive_randomly(simulator_.get(), config.seed, 1 + random.below(30));
  }

  // Of agents, as they are or from somewhere near them.
  std::vector<View> views(int64_t scene) const {
    RandomStream random = random_of(options_, scene, 2);
    const Span<const View> of_agents = simulator_->views();
    std::vector<View> views;
    for (int i = 0; i < options_.views; ++i) {
      View view = of_agents[static_cast<std::size_t>(random.below(static_cast<int>(of_agents.size())))];
      if (random.below(2) == 0) {
        const View moved = make_view(view.origin_m + Vec3{random.uniform(-20.0f, 20.0f), random.uniform(-20.0f, 20.0f),
                                                          random.uniform(-2.0f, 20.0f)},
                                     random.uniform(0.0f, kTwoPi));
        view.origin_m = moved.origin_m;
        view.cos_heading = moved.cos_heading;
        view.sin_heading = moved.sin_heading;
      }
      views.push_back(view);
    }
    return views;
  }

  Simulator& simulator() { return *simulator_; }

 private:
  SoakOptions options_;
  std::vector<std::shared_ptr<const RoadMap>> maps_;
  std::unique_ptr<Simulator> simulator_;
};

}  // namespace

SoakResult soak(const SoakOptions& options, const std::function<void(const SoakResult&)>& on_scene) {
  const auto begin = std::chrono::steady_clock::now();
  SoakResult result;
  Scenes scenes(options);
  const std::vector<Rig> rigs = draw_rigs(options);
  for (int64_t scene = options.first_scene;; ++scene) {
    if (interrupted()) throw Interrupted("interrupted");
    scenes.drive(scene);
    const RendererConfig config{.rig = rigs[static_cast<std::size_t>(scene) % rigs.size()],
                                .num_threads = options.num_threads};
    const auto renderer = make_renderer(options.backend, config, &result.choice), oracle = make_renderer("cpu", config);
    for (const StaticGeometry& geometry : scenes.simulator().geometries()) {
      renderer->upload(geometry);
      oracle->upload(geometry);
    }
    const std::vector<View> views = scenes.views(scene);
    HostImages drawn(config.rig, options.views), expected(config.rig, options.views);
    renderer->render(scenes.simulator().scene(), views, drawn.batch());
    oracle->render(scenes.simulator().scene(), views, expected.batch());
    for (int camera = 0; camera < static_cast<int>(config.rig.cameras.size()); ++camera) {
      for (int view = 0; view < options.views; ++view) {
        const ImageError error = compare_image(drawn.camera(camera), expected.camera(camera), PixelFormat::u8, view);
        result.error.add(error);
        ++result.images;
        if (error.is_within_tolerance()) continue;
        ++result.images_out_of_tolerance;
        if (result.faults.size() < kMostFaults) result.faults.push_back({scene, view, camera, error});
      }
    }
    ++result.scenes;
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    on_scene(result);
    if (result.scenes == options.most_scenes || result.seconds >= options.most_seconds) return result;
  }
}

}  // namespace pictura
