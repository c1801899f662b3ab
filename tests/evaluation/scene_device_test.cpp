// Evaluations in recorded scenes on a CUDA device give the results of the host. Skipped without a device, as in
// device_test.cpp.
#include <fmt/format.h>

#include "pictura/evaluation/evaluate_scenes.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/support/recorded_crossing.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

class DeviceSceneEvaluations : public test::DeviceTest {};

TEST_F(DeviceSceneEvaluations, EqualThoseOnTheHost) {
  const test::ScratchFolder folder;
  for (const uint64_t seed : {1, 2, 3}) {
    write_scene_file(folder / fmt::format("{}.scenario", seed), *test::crossing({.seed = seed, .num_vehicles = 6}));
  }
  for (const char* controller : {"inverse", "random", "idm"}) {
    for (const char* protocol : {"womd", "simagents"}) {
      SCOPED_TRACE(fmt::format("{} by {}", controller, protocol));
      const auto figures = [&](const std::string& device) {
        std::string text;
        SceneEvaluateOptions options;
        options.controller = controller;
        options.device = device;
        options.num_threads = 1;
        options.scenes = {folder.path()};
        options.protocol = scene_protocol(protocol);
        options.on_agent = [&text](const SceneAgent& agent) { text += csv_line(agent); };
        if (options.protocol.name == "simagents") {
          options.on_rollouts = [&text](const SceneRollouts& scene) { text += encoded(scene); };
        }
        const SceneEvaluation evaluation = evaluate_scenes(options);
        const bool is_cpu = device == "cpu", is_on_host = std::string(controller) == "idm";
        EXPECT_EQ(evaluation.results.setting.device, is_cpu       ? "cpu"
                                                     : is_on_host ? "cuda, driven from the host"
                                                                  : "cuda");
        return text;
      };
      // Not printed: rollouts are long.
      EXPECT_TRUE(figures("cuda") == figures("cpu"));
    }
  }
}

}  // namespace
}  // namespace pictura
