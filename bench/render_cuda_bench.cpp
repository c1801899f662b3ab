// Times the CUDA renderer on the device alone: scenes, views and images lie in device memory, one call is one launch
// for all egos. Validates against the oracle before it times. Prints one JSON object.
#include <algorithm>
#include <cmath>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <random>
#include <sstream>

#include "pictura/common/cuda/device_scene.cuh"
#include "pictura/common/error.h"
#include "pictura/common/make_renderer.h"
#include "pictura/map/load_map.h"
#include "pictura/simulator/simulator.h"

using namespace pictura;

namespace {

std::vector<std::string> split(const std::string& text) {
  std::vector<std::string> parts;
  std::stringstream stream(text);
  for (std::string part; std::getline(stream, part, ',');) parts.push_back(part);
  return parts;
}

}  // namespace

int main(int argc, char** argv) {
  std::vector<std::string> maps = split("Town01,Town02,Town03,Town04,Town05,Town06,Town07,Town10HD");
  std::vector<std::string> egos{"2048", "256"}, sizes{"96x54"};
  bool walls = true;
  int check = 64;
  for (int i = 1; i < argc; ++i) {
    const std::string name = argv[i];
    auto value = [&] { return std::string(argv[++i]); };
    if (name == "--maps") maps = split(value());
    if (name == "--egos") egos = split(value());
    if (name == "--sizes") sizes = split(value());
    if (name == "--walls") walls = value() == "1";
    if (name == "--check") check = std::atoi(value().c_str());
  }
  int most = 0;
  for (const auto& n : egos) most = std::max(most, std::atoi(n.c_str()));
  std::vector<std::shared_ptr<const RoadMap>> loaded;
  for (const auto& name : maps) loaded.push_back(load_map(name));
  SimulatorConfig config;
  config.parked_cars = 32;
  config.walls = walls;
  config.vector_observations = false;
  std::vector<WorldSpec> worlds;
  for (int filled = 0; filled < most; filled += 120) {
    worlds.push_back({static_cast<int>(worlds.size() % loaded.size()), 120, static_cast<uint32_t>(worlds.size())});
  }
  const auto simulator = make_simulator("cpu", config, loaded, worlds);
  std::mt19937 random(1);
  std::vector<int32_t> actions(static_cast<size_t>(simulator->num_slots()));
  for (int step = 0; step < 50; ++step) {
    for (auto& action : actions) action = static_cast<int32_t>(random() % 12);
    simulator->step(actions);
  }
  // Egos of all worlds alike: slot k of world 0, 1, ..., then slot k + 1.
  std::vector<View> views;
  const auto all = simulator->views();
  for (int k = 0; k < 120; ++k) {
    for (size_t w = 0; w < worlds.size(); ++w) views.push_back(all[w * 120 + static_cast<size_t>(k)]);
  }
  const DeviceScene scene(simulator->scene());
  const auto geometries = simulator->geometries();
  std::printf("{\"results\": [\n");
  bool first = true;
  for (const auto& size : sizes) {
    int width = 0, height = 0;
    std::sscanf(size.c_str(), "%dx%d", &width, &height);
    RendererConfig renderer_config;
    renderer_config.rig = paper_rig(width, height);
    const auto oracle = make_renderer("cpu", renderer_config);
    renderer_config.space = MemorySpace::cuda;
    const auto renderer = make_renderer("cuda", renderer_config);
    for (const auto& geometry : geometries) {
      renderer->upload(geometry);
      oracle->upload(geometry);
    }
    for (const auto& ego_text : egos) {
      const auto count = static_cast<size_t>(std::atoi(ego_text.c_str()));
      const DeviceBuffer<View> device_views(Span<const View>(views.data(), count));
      const size_t pixels = static_cast<size_t>(width) * static_cast<size_t>(height);
      DeviceBuffer<uint8_t> out(count * 12 * pixels);
      std::vector<CameraImages> cameras;
      for (size_t c = 0; c < 4; ++c) {
        cameras.push_back({width, height, out.data() + 3 * pixels * c, static_cast<int64_t>(12 * pixels)});
      }
      const ImageBatch batch{MemorySpace::cuda, PixelFormat::u8, static_cast<int>(count), cameras};
      renderer->render(scene.batch(), device_views.span(), batch);
      PICTURA_CUDA(cudaDeviceSynchronize());
      int worst = 0;
      int64_t off = 0, values = 0;
      if (check > 0) {
        const size_t checked = std::min(count, static_cast<size_t>(check));
        HostImages images(renderer_config.rig, static_cast<int>(checked));
        oracle->render(simulator->scene(), {views.data(), checked}, images.batch());
        std::vector<uint8_t> host(count * 12 * pixels);
        out.copy_to_host(host.data());
        for (size_t v = 0; v < checked; ++v) {
          for (int c = 0; c < 4; ++c) {
            const CameraImages& camera = images.camera(c);
            const auto* want = static_cast<const uint8_t*>(camera.data) + static_cast<int64_t>(v) * camera.view_stride;
            const uint8_t* got = host.data() + v * 12 * pixels + 3 * pixels * static_cast<size_t>(c);
            for (size_t p = 0; p < 3 * pixels; ++p) {
              const int d = std::abs(int{want[p]} - int{got[p]});
              worst = std::max(worst, d);
              off += d > 0;
              ++values;
            }
          }
        }
      }
      cudaEvent_t begin, end;
      cudaEventCreate(&begin);
      cudaEventCreate(&end);
      std::vector<float> ms;
      for (int repeat = 0; repeat < 23; ++repeat) {
        cudaEventRecord(begin);
        renderer->render(scene.batch(), device_views.span(), batch);
        cudaEventRecord(end);
        PICTURA_CUDA(cudaEventSynchronize(end));
        float t = 0;
        cudaEventElapsedTime(&t, begin, end);
        if (repeat >= 3) ms.push_back(t);
      }
      std::sort(ms.begin(), ms.end());
      const double median = ms[ms.size() / 2];
      size_t free_bytes = 0, total_bytes = 0;
      cudaMemGetInfo(&free_bytes, &total_bytes);
      std::printf(
          "%s{\"size\": \"%s\", \"egos\": %zu, \"ms\": %.4f, \"min_ms\": %.4f, \"max_ms\": %.4f, "
          "\"agent_steps_per_s\": %.4g, \"checked_values\": %lld, \"differ\": %lld, \"worst\": %d, \"used_gib\": "
          "%.3f}\n",
          first ? "" : ",", size.c_str(), count, median, ms.front(), ms.back(), 1e3 * count / median,
          static_cast<long long>(values), static_cast<long long>(off), worst,
          (total_bytes - free_bytes) / 1073741824.0);
      std::fflush(stdout);
      first = false;
    }
  }
  std::printf("]}\n");
}
