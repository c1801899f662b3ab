#include "pictura/bench/soak.h"

#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/bench/driving.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/rng.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/load_map.h"

namespace pictura {

namespace {

constexpr std::size_t kMaxFaults = 100;
constexpr int kQueries = 32;          // visibility queries per scene
constexpr int kMaxHiddenAgents = 64;  // agents that one view hides

// Random parts of a scene. Each part has its own stream of random numbers.
enum class Draw : uint32_t { rigs, world, views, settings, hidden_agents, queries };

RandomStream random_of(const SoakOptions& options, int64_t scene, Draw what) {
  const auto high = static_cast<uint32_t>(scene >> 32), low = static_cast<uint32_t>(scene);
  return RandomStream({.seed = options.seed,
                       .world = static_cast<uint32_t>(what),
                       .episode = high,
                       .step = low,
                       .purpose = Purpose::soak});
}

// Returns paper_rig() and three rigs whose cameras have random sizes. There are only four rigs, because kernels are
// compiled for each rig.
std::vector<Rig> draw_rigs(const SoakOptions& options) {
  std::vector<Rig> rigs{paper_rig()};
  RandomStream random = random_of(options, 0, Draw::rigs);
  while (rigs.size() < 4) {
    Rig rig = paper_rig();
    rig.cameras.resize(1 + random.below(4));
    for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
      const int width_px = 1 + random.below(220), height_px = 1 + random.below(130);
      rig.cameras[k] = paper_rig(width_px, height_px).cameras[k];
    }
    rigs.push_back(rig);
  }
  return rigs;
}

// Settings of the renderer and of the call. Kernels do not depend on these settings.
struct Settings {
  RendererConfig config;
  PixelFormat format = PixelFormat::u8;
  Planes planes = Planes::none;
};

Settings draw_settings(const SoakOptions& options, int64_t scene, const std::vector<Rig>& rigs) {
  RandomStream random = random_of(options, scene, Draw::settings);
  const std::size_t rig = static_cast<std::size_t>(scene) % rigs.size();
  Settings settings{.config = {.rig = rigs[rig], .num_threads = options.num_threads}};
  const float floors_px[] = {0, settings.config.line_floor_px, random.uniform(0, kGuardBand_px)};
  settings.config.line_floor_px = floors_px[random.below(3)];
  settings.config.debug_palette = random.below(2) > 0;
  const PixelFormat formats[] = {PixelFormat::u8, PixelFormat::f16, PixelFormat::f32};
  settings.format = formats[random.below(3)];
  settings.planes = random.below(2) > 0 ? Planes::all : Planes::none;
  // Kernels are compiled with or without randomization, so each rig always has the same choice.
  if (rig % 2 > 0) {
    settings.config.randomization = scaled(kFullCameraSeverity, static_cast<double>(random.uniform(0, 2)));
    settings.config.randomization.seed = random.bits();
  }
  return settings;
}

// Views of a scene, and the list of hidden agents. Each view hides a range of this list.
struct ViewsOfScene {
  std::vector<View> views;
  std::vector<int32_t> hidden_agents;
};

// Scenes, each from a separately simulated world. The scene's number selects the map and the number of steps, so that a
// scene can be repeated without the scenes before it.
class Scenes {
 public:
  explicit Scenes(const SoakOptions& options) : options_(options) {
    for (const std::string& map : options.maps) maps_.push_back(load_map(map));
    for (CompiledMaps& maps : compiled_) maps.resize(maps_.size());
  }

  void drive(int64_t scene) {
    RandomStream random = random_of(options_, scene, Draw::world);
    SimulatorConfig config;
    config.seed = random.bits();
    config.num_threads = options_.num_threads;
    config.parked_cars = options_.parked_cars;
    config.walls = random.below(4) > 0;
    config.vector_observations = false;
    const auto map = static_cast<std::size_t>(random.below(static_cast<int>(maps_.size())));
    const WorldSpec world{0, 1 + random.below(options_.agents), static_cast<uint32_t>(scene)};
    std::shared_ptr<const CompiledMap>& compiled = compiled_[config.walls][map];
    if (!compiled) compiled = compile_map(maps_[map], map_options(config));
    simulator_ = make_simulator("cpu", config, CompiledMaps{compiled}, {world});
    step_randomly(simulator_.get(), config.seed, 1 + random.below(30));
  }

  // Returns views of agents. Half of the views are moved and turned at random, and some views hide more agents than
  // their own.
  ViewsOfScene views(int64_t scene) const {
    RandomStream random = random_of(options_, scene, Draw::views);
    const Span<const View> of_agents = simulator_->views();
    ViewsOfScene result;
    for (int i = 0; i < options_.views; ++i) {
      View view = of_agents[random.below(static_cast<int>(of_agents.size()))];
      if (random.below(2) == 0) {
        const View moved = make_view(view.origin_m + Vec3{random.uniform(-20.0f, 20.0f), random.uniform(-20.0f, 20.0f),
                                                          random.uniform(-2.0f, 20.0f)},
                                     random.uniform(0.0f, kTwoPi));
        view.origin_m = moved.origin_m;
        view.cos_heading = moved.cos_heading;
        view.sin_heading = moved.sin_heading;
      }
      result.views.push_back(view);
    }
    hide_agents(scene, &result);
    return result;
  }

  // Returns the scene with the views' list of hidden agents.
  SceneBatch batch(const ViewsOfScene& views) const {
    SceneBatch batch = simulator_->scene();
    batch.hidden_agents = views.hidden_agents;
    return batch;
  }

  std::vector<VisibilityQuery> queries(int64_t scene) const {
    RandomStream random = random_of(options_, scene, Draw::queries);
    std::vector<VisibilityQuery> queries(kQueries);
    for (VisibilityQuery& query : queries) query = {random.below(options_.views), random.below(num_agents())};
    return queries;
  }

  void upload(Renderer* renderer_out) const { upload_maps(*simulator_, renderer_out); }

 private:
  int num_agents() const { return static_cast<int>(simulator_->scene().agents.size()); }

  void hide_agents(int64_t scene, ViewsOfScene* views_inout) const {
    RandomStream random = random_of(options_, scene, Draw::hidden_agents);
    std::vector<int32_t>& hidden = views_inout->hidden_agents;
    for (View& view : views_inout->views) {
      view.hidden_begin = static_cast<int32_t>(hidden.size());
      const int count = random.below(2) > 0 ? 1 + random.below(std::min(num_agents(), kMaxHiddenAgents)) : 0;
      for (int i = 0; i < count; ++i) hidden.push_back(random.below(num_agents()));
      view.hidden_end = static_cast<int32_t>(hidden.size());
    }
  }

  SoakOptions options_;
  std::vector<std::shared_ptr<const RoadMap>> maps_;
  std::array<CompiledMaps, 2> compiled_;  // without and with walls
  std::unique_ptr<Simulator> simulator_;
};

// Adds a fault unless there are already kMaxFaults.
template <typename Fault>
void add_fault(const Fault& fault, std::vector<Fault>* faults_out, SoakResult* result_out) {
  if (result_out->first_faulty_scene < 0) result_out->first_faulty_scene = fault.scene;
  if (faults_out->size() < kMaxFaults) faults_out->push_back(fault);
}

// Draws a scene with both renderers, and adds the differences to result_out.
void compare_images(int64_t scene, const SceneBatch& batch, const std::vector<View>& views, const Settings& settings,
                    Renderer* renderer, Renderer* oracle, SoakResult* result_out) {
  const Rig& rig = settings.config.rig;
  const int num_views = static_cast<int>(views.size());
  HostImages drawn(rig, num_views, settings.format, settings.planes);
  HostImages expected(rig, num_views, settings.format, settings.planes);
  fill_unwritten(drawn.batch());
  renderer->render(batch, views, drawn.batch());
  renderer->check();
  oracle->render(batch, views, expected.batch());
  for (int camera = 0; camera < static_cast<int>(rig.cameras.size()); ++camera) {
    for (int view = 0; view < num_views; ++view) {
      const ImageError error = compare_image(drawn.camera(camera), expected.camera(camera), settings.format, view);
      result_out->error.add(error);
      ++result_out->images;
      if (error.is_within_tolerance()) continue;
      ++result_out->images_out_of_tolerance;
      add_fault({scene, view, camera, error}, &result_out->faults, result_out);
    }
  }
}

// Computes visibilities with both renderers, and adds the differences to result_out.
void compare_visibility(int64_t scene, const SceneBatch& batch, const std::vector<View>& views,
                        const std::vector<VisibilityQuery>& queries, Renderer* renderer, Renderer* oracle,
                        SoakResult* result_out) {
  std::vector<float> answers(queries.size(), -1.0f), expected(queries.size());
  renderer->visibility(batch, views, queries, answers);
  renderer->check();
  oracle->visibility(batch, views, queries, expected);
  result_out->queries += static_cast<int64_t>(queries.size());
  for (std::size_t i = 0; i < queries.size(); ++i) {
    const bool in_no_frame = std::isnan(expected[i]) && std::isnan(answers[i]);
    if (in_no_frame || answers[i] == expected[i]) continue;  // exact comparison, because the sums are integers
    ++result_out->differing_answers;
    add_fault({scene, queries[i], answers[i], expected[i]}, &result_out->visibility_faults, result_out);
  }
}

// Simulates a scene, draws it with both renderers, and adds the differences to result_out.
void compare_scene(const SoakOptions& options, const MakeRenderer& make, int64_t scene, const std::vector<Rig>& rigs,
                   Scenes* scenes, SoakResult* result_out) {
  scenes->drive(scene);
  const Settings settings = draw_settings(options, scene, rigs);
  const auto renderer = make(settings.config, &result_out->choice);
  const auto oracle = make_renderer("cpu", settings.config);
  scenes->upload(renderer.get());
  scenes->upload(oracle.get());
  const ViewsOfScene views = scenes->views(scene);
  const SceneBatch batch = scenes->batch(views);
  compare_images(scene, batch, views.views, settings, renderer.get(), oracle.get(), result_out);
  compare_visibility(scene, batch, views.views, scenes->queries(scene), renderer.get(), oracle.get(), result_out);
  ++result_out->scenes;
}

}  // namespace

SoakResult soak(const SoakOptions& options, const MakeRenderer& make,
                const std::function<void(const SoakResult&)>& on_scene) {
  const auto begin = std::chrono::steady_clock::now();
  SoakResult result;
  Scenes scenes(options);
  const std::vector<Rig> rigs = draw_rigs(options);
  for (int64_t scene = options.first_scene;; ++scene) {
    throw_if_interrupted();
    try {
      compare_scene(options, make, scene, rigs, &scenes, &result);
    } catch (const UsageError&) {
      throw;
    } catch (const Error& error) {
      fail("scene {}: {}", scene, error.what());
    }
    result.seconds = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
    on_scene(result);
    if (result.scenes == options.max_scenes || result.seconds >= options.max_seconds) return result;
  }
}

}  // namespace pictura
