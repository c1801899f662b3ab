// The CUDA renderer in a training loop, on a device: formats, written and untouched memory, streams, graphs,
// allocations, and the memory limit.
#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstring>
#include <functional>
#include <thread>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/bench/truth/image_scenes.h"
#include "pictura/common/cuda/device_scene.h"
#include "pictura/common/raster/compositing.h"
#include "pictura/tests/backend_cuda/device_test.h"
#include "pictura/tests/support/allocations.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/tests/support/scratch_folder.h"

namespace pictura {
namespace {

using test::CapturedGraph;
using test::OwnStream;
using testing::HasSubstr;
using testing::StartsWith;

class CudaStreamTest : public test::DeviceTest {};

// A scene in device memory, and a renderer for callers with device memory.
struct Stage {
  Snapshot town;
  RendererConfig config;
  DeviceScene scene;
  DeviceUpload<View> view_copy;
  Span<const View> views;
  std::unique_ptr<Renderer> renderer;
  DeviceImages images;

  Stage(int agents, std::size_t num_views, RendererConfig renderer_config) : config(renderer_config) {
    town = make_synthetic_town(7, agents);
    town.views.resize(num_views);
    scene.assign(town.scene.batch());
    views = view_copy.assign(Span<const View>(town.views), nullptr);
    config.device = {MemorySpace::cuda, 0};
    renderer = make_renderer("cuda", config);
    renderer->upload(0, town.geometry);
  }
  HostImages host_images(PixelFormat format = PixelFormat::u8, Planes planes = Planes::none) const {
    return {config.rig, static_cast<int>(views.size()), format, planes};
  }
  // Returns the images that the renderer draws.
  HostImages draw(PixelFormat format = PixelFormat::u8, Stream stream = {}) {
    HostImages host = host_images(format);
    renderer->render(scene.batch(), views, images.like(host.batch()), stream);
    PICTURA_CUDA(cudaDeviceSynchronize());
    images.copy_to_host(host.batch());
    PICTURA_CUDA(cudaDeviceSynchronize());
    return host;
  }
};

std::vector<uint8_t> bytes_of(const HostImages& images) { return {images.bytes().begin(), images.bytes().end()}; }

template <typename Value>
std::vector<Value> values_of(const HostImages& images) {
  std::vector<Value> values(images.bytes().size() / sizeof(Value));
  std::memcpy(values.data(), images.bytes().data(), images.bytes().size());
  return values;
}

TEST_F(CudaStreamTest, AllFormatsHoldTheSameColours) {
  Stage stage(60, 12, {.rig = paper_rig()});
  const auto floats = values_of<float>(stage.draw(PixelFormat::f32));
  const auto halves = values_of<uint16_t>(stage.draw(PixelFormat::f16));
  const auto bytes = values_of<uint8_t>(stage.draw(PixelFormat::u8));
  ASSERT_EQ(halves.size(), floats.size());
  ASSERT_EQ(bytes.size(), floats.size());
  std::size_t lit = 0;
  for (std::size_t i = 0; i < floats.size(); ++i) {
    lit += floats[i] > 0;
    ASSERT_EQ(halves[i], to_half(floats[i])) << i;
    ASSERT_EQ(bytes[i], to_byte(floats[i])) << i;
  }
  EXPECT_GT(lit, floats.size() / 100);
}

TEST_F(CudaStreamTest, WritesExactlyTheValuesOfItsImages) {
  constexpr std::size_t kViews = 5, kGap = 7;
  Rig rig = paper_rig(33, 19);
  rig.cameras[2] = paper_rig(8, 40).cameras[2];
  for (const PixelFormat format : {PixelFormat::u8, PixelFormat::f16, PixelFormat::f32}) {
    Stage stage(60, kViews, {.rig = rig});
    std::vector<std::vector<uint8_t>> drawn;
    for (const int poison : {0xA5, 0x5A}) {
      std::vector<DeviceBuffer<uint8_t>> memory, planes;
      std::vector<CameraImages> cameras;
      auto poisoned = [&](std::size_t bytes) {
        planes.emplace_back(bytes);
        planes.back().fill(poison);
        return planes.back().data();
      };
      for (const Camera& camera : rig.cameras) {
        const std::size_t stride = static_cast<std::size_t>(3 * camera.width_px * camera.height_px) + kGap;
        memory.emplace_back(kViews * stride * bytes_per_value(format));
        memory.back().fill(poison);
        const std::size_t pixels = kViews * static_cast<std::size_t>(camera.width_px * camera.height_px);
        cameras.push_back({camera.width_px, camera.height_px, memory.back().data(), static_cast<int64_t>(stride),
                           reinterpret_cast<float*>(poisoned(pixels * sizeof(float))), poisoned(pixels),
                           reinterpret_cast<uint16_t*>(poisoned(pixels * sizeof(uint16_t)))});
      }
      stage.renderer->render(stage.scene.batch(), stage.views,
                             {stage.config.device, format, static_cast<int>(kViews), cameras});
      std::vector<uint8_t> all;
      for (std::size_t k = 0; k < memory.size(); ++k) {
        std::vector<uint8_t> bytes(memory[k].size());
        memory[k].copy_to_host(bytes.data());
        const std::size_t stride_bytes = bytes.size() / kViews, gap_bytes = kGap * bytes_per_value(format);
        for (std::size_t view = 0; view < kViews; ++view) {
          const auto image = bytes.begin() + static_cast<std::ptrdiff_t>(view * stride_bytes);
          const auto gap = image + static_cast<std::ptrdiff_t>(stride_bytes - gap_bytes);
          all.insert(all.end(), image, gap);
          ASSERT_TRUE(std::all_of(gap, gap + static_cast<std::ptrdiff_t>(gap_bytes),
                                  [&](uint8_t byte) { return byte == poison; }))
              << "camera " << k << ", view " << view;
        }
      }
      for (const DeviceBuffer<uint8_t>& plane : planes) {
        const std::size_t begin = all.size();
        all.resize(begin + plane.size());
        plane.copy_to_host(all.data() + begin);
      }
      drawn.push_back(all);
    }
    EXPECT_EQ(drawn[0], drawn[1]);
  }
}

// Keeps a stream busy until it is released, or for ten seconds.
class Blocker {
 public:
  explicit Blocker(cudaStream_t stream) {
    PICTURA_CUDA(cudaLaunchHostFunc(
        stream,
        [](void* self) {
          auto* blocker = static_cast<Blocker*>(self);
          for (int i = 0; i < 10'000 && !blocker->released_; ++i) {
            std::this_thread::sleep_for(std::chrono::milliseconds(1));
          }
          blocker->was_released_ = blocker->released_.load();
        },
        this));
  }
  void release() { released_ = true; }
  bool was_released() const { return was_released_; }

 private:
  std::atomic<bool> released_ = false, was_released_ = false;
};

TEST_F(CudaStreamTest, RunsOnTheCallersStreamWithoutWaitingOrAllocating) {
  Stage stage(60, 12, {.rig = paper_rig()});
  const std::vector<uint8_t> expected = bytes_of(stage.draw());
  DeviceUpload<VisibilityQuery> query_copy;
  const std::vector<VisibilityQuery> host_queries{{0, 1}, {2, 3}};
  const Span<const VisibilityQuery> queries = query_copy.assign(Span<const VisibilityQuery>(host_queries), nullptr);
  DeviceBuffer<float> answers(host_queries.size());
  cudaStream_t stream = nullptr;
  PICTURA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  HostImages host = stage.host_images();
  const ImageBatch batch = stage.images.like(host.batch());
  const Span<float> room{answers.data(), answers.size()};
  stage.renderer->visibility(stage.scene.batch(), stage.views, queries, room, {stream});
  PICTURA_CUDA(cudaDeviceSynchronize());

  Blocker blocker(stream);
  const long before = test::allocations();
  stage.renderer->render(stage.scene.batch(), stage.views, batch, {stream});
  stage.renderer->visibility(stage.scene.batch(), stage.views, queries, room, {stream});
  EXPECT_EQ(test::allocations(), before);
  EXPECT_EQ(cudaStreamQuery(stream), cudaErrorNotReady);
  blocker.release();
  PICTURA_CUDA(cudaStreamSynchronize(stream));
  EXPECT_TRUE(blocker.was_released()) << "render() waited for its stream";
  stage.images.copy_to_host(host.batch());
  PICTURA_CUDA(cudaDeviceSynchronize());
  EXPECT_EQ(bytes_of(host), expected);
  PICTURA_CUDA(cudaStreamDestroy(stream));
}

// Returns the minimum limit under which the stage's scene can be drawn, from the renderer's error messages.
std::size_t min_scratch_bytes(int agents, std::size_t num_views, RendererConfig config) {
  auto minimum_in_message = [](const std::function<void()>& work) -> std::size_t {
    const std::string message = test::message_of(work), marker = "max_scratch_bytes: expected at least ";
    const std::size_t at = message.find(marker);
    if (at != std::string::npos) return std::stoull(message.substr(at + marker.size()));
    ADD_FAILURE() << message;
    return 0;
  };
  config.max_scratch_bytes = 0;
  config.max_scratch_bytes = minimum_in_message([&] { Stage(agents, num_views, config); });
  return minimum_in_message([&] { Stage(agents, num_views, config).draw(); });
}

// Captures reject every call that allocates or waits.
TEST_F(CudaStreamTest, IsCapturedIntoAGraph) {
  RendererConfig config{.rig = paper_rig()};
  config.max_scratch_bytes = min_scratch_bytes(60, 7, config) + 40;  // one view at a time
  Stage stage(60, 7, config);
  const std::vector<uint8_t> first = bytes_of(stage.draw());
  HostImages host = stage.host_images();
  const ImageBatch batch = stage.images.like(host.batch());
  cudaStream_t stream = nullptr;
  PICTURA_CUDA(cudaStreamCreateWithFlags(&stream, cudaStreamNonBlocking));
  cudaGraph_t graph = nullptr;
  cudaGraphExec_t executable = nullptr;
  PICTURA_CUDA(cudaStreamBeginCapture(stream, cudaStreamCaptureModeGlobal));
  EXPECT_NO_THROW(stage.renderer->render(stage.scene.batch(), stage.views, batch, {stream}));
  PICTURA_CUDA(cudaStreamEndCapture(stream, &graph));
  std::size_t nodes = 0;
  PICTURA_CUDA(cudaGraphGetNodes(graph, nullptr, &nodes));
  EXPECT_EQ(nodes, 42u);  // six launches for each view
  PICTURA_CUDA(cudaGraphInstantiate(&executable, graph, 0));

  auto replay = [&] {
    const Span<uint8_t> colors = stage.images.color_bytes();
    PICTURA_CUDA(cudaMemset(colors.data(), 0x5A, colors.size()));
    PICTURA_CUDA(cudaDeviceSynchronize());
    PICTURA_CUDA(cudaGraphLaunch(executable, stream));
    PICTURA_CUDA(cudaStreamSynchronize(stream));
    stage.images.copy_to_host(host.batch());
    PICTURA_CUDA(cudaDeviceSynchronize());
    return bytes_of(host);
  };
  EXPECT_EQ(replay(), first);
  // The graph reads the scene again, after all agents have moved forward.
  for (AgentBox& box : stage.town.scene.agents) {
    box.center_m.x += 2 * box.cos_heading;
    box.center_m.y += 2 * box.sin_heading;
  }
  stage.scene.assign(stage.town.scene.batch());
  const std::vector<uint8_t> second = replay();
  EXPECT_NE(second, first);
  EXPECT_EQ(bytes_of(stage.draw()), second);
  PICTURA_CUDA(cudaGraphExecDestroy(executable));
  PICTURA_CUDA(cudaGraphDestroy(graph));
  PICTURA_CUDA(cudaStreamDestroy(stream));
}

TEST_F(CudaStreamTest, ACaptureAfterReserveNeedsNoEarlierRender) {
  const std::vector<uint8_t> expected = bytes_of(Stage(60, 7, {.rig = paper_rig()}).draw());
  Stage stage(60, 7, {.rig = paper_rig()});
  const int boxes = static_cast<int>(stage.town.scene.agents.size());
  stage.renderer->reserve(7, boxes);
  const uint64_t generation = stage.renderer->generation();
  HostImages host = stage.host_images();
  const ImageBatch batch = stage.images.like(host.batch());
  DeviceUpload<VisibilityQuery> query_copy;
  const std::vector<VisibilityQuery> host_queries{{0, 1}, {2, 3}};
  const Span<const VisibilityQuery> queries = query_copy.assign(Span<const VisibilityQuery>(host_queries), nullptr);
  DeviceBuffer<float> answers(host_queries.size());
  PICTURA_CUDA(cudaDeviceSynchronize());
  const OwnStream own;
  const CapturedGraph graph(own.stream, [&] {
    stage.renderer->render(stage.scene.batch(), stage.views, batch, {own.stream});
    stage.renderer->visibility(stage.scene.batch(), stage.views, queries, {answers.data(), answers.size()},
                               {own.stream});
  });
  EXPECT_EQ(stage.renderer->generation(), generation);
  PICTURA_CUDA(cudaGraphLaunch(graph.executable, own.stream));
  stage.renderer->check({own.stream});
  stage.images.copy_to_host(host.batch());
  PICTURA_CUDA(cudaDeviceSynchronize());
  EXPECT_EQ(bytes_of(host), expected);
  // Below the reserved sizes nothing moves; above them graphs become stale.
  stage.renderer->reserve(3, boxes / 2);
  EXPECT_EQ(stage.renderer->generation(), generation);
  stage.renderer->reserve(8, boxes);
  EXPECT_GT(stage.renderer->generation(), generation);
  const uint64_t grown = stage.renderer->generation();
  stage.renderer->upload(40'000, stage.town.geometry);
  EXPECT_GT(stage.renderer->generation(), grown) << "the table of maps has moved";
  StaticGeometry larger = stage.town.geometry;
  larger.walls.push_back(larger.walls.front());
  larger.build_grids();
  const uint64_t before_larger = stage.renderer->generation();
  stage.renderer->upload(1, stage.town.geometry);
  EXPECT_EQ(stage.renderer->generation(), before_larger);
  stage.renderer->upload(1, larger);
  EXPECT_GT(stage.renderer->generation(), before_larger);
  EXPECT_THAT(test::message_of([&] { stage.renderer->reserve(-1, 0); }), HasSubstr("reserve: expected 0 views"));
}

TEST_F(CudaStreamTest, PollsWithoutWaitingAndChecksOnlyItsStream) {
  Stage stage(20, 2, {.rig = paper_rig(16, 9)});
  stage.draw();
  stage.town.views[1].world = 9;
  stage.views = stage.view_copy.assign(Span<const View>(stage.town.views), nullptr);
  HostImages host = stage.host_images();
  const ImageBatch batch = stage.images.like(host.batch());
  PICTURA_CUDA(cudaDeviceSynchronize());
  const OwnStream own, other;
  Blocker blocker(own.stream);
  stage.renderer->render(stage.scene.batch(), stage.views, batch, {own.stream});
  EXPECT_NO_THROW(stage.renderer->poll());
  EXPECT_EQ(cudaStreamQuery(own.stream), cudaErrorNotReady);
  blocker.release();
  Blocker busy(other.stream);
  EXPECT_THAT(test::message_of([&] { stage.renderer->check({own.stream}); }), HasSubstr("view 1: no such world"));
  EXPECT_EQ(cudaStreamQuery(other.stream), cudaErrorNotReady) << "check() waited for another stream";
  EXPECT_NO_THROW(stage.renderer->poll());
  busy.release();
  PICTURA_CUDA(cudaStreamSynchronize(other.stream));
  EXPECT_TRUE(busy.was_released());
}

// A captured graph cannot ask the host. It draws the number of views that the device holds at the replay.
TEST_F(CudaStreamTest, TheNumberOfViewsIsReadOnTheDevice) {
  RendererConfig tight{.rig = paper_rig(24, 14)};
  tight.max_scratch_bytes = min_scratch_bytes(30, 5, tight) + 40;  // one view at a time
  for (const RendererConfig& config : {RendererConfig{.rig = paper_rig(24, 14)}, tight}) {
    Stage stage(30, 5, config);
    const std::vector<uint8_t> all = bytes_of(stage.draw());
    HostImages host = stage.host_images();
    const ImageBatch batch = stage.images.like(host.batch());
    DeviceBuffer<int32_t> count(1);
    PICTURA_CUDA(cudaDeviceSynchronize());
    const OwnStream own;
    const CapturedGraph graph(own.stream, [&] {
      stage.renderer->render(stage.scene.batch(), {stage.views, count.data()}, batch, {own.stream});
    });
    const Span<uint8_t> colors = stage.images.color_bytes();
    const std::size_t view_bytes = colors.size() / 5;
    for (const int32_t drawn : {2, 5, 0, 3, -1, 6}) {
      SCOPED_TRACE(drawn);
      count.copy_from_host(&drawn);
      PICTURA_CUDA(cudaMemset(colors.data(), 0x5A, colors.size()));
      PICTURA_CUDA(cudaDeviceSynchronize());
      PICTURA_CUDA(cudaGraphLaunch(graph.executable, own.stream));
      const std::string told = test::message_of([&] { stage.renderer->check({own.stream}); });
      if (drawn < 0 || drawn > 5) {
        EXPECT_THAT(told, HasSubstr("number of views " + std::to_string(drawn) + ": expected 0 or more"));
      } else {
        EXPECT_EQ(told, test::kNoError);
      }
      stage.images.copy_to_host(host.batch());
      PICTURA_CUDA(cudaDeviceSynchronize());
      const std::size_t written = static_cast<std::size_t>(std::clamp(drawn, 0, 5)) * view_bytes;
      const std::vector<uint8_t> bytes = bytes_of(host);
      const auto border = bytes.begin() + static_cast<std::ptrdiff_t>(written);
      EXPECT_TRUE(std::equal(bytes.begin(), border, all.begin()));
      EXPECT_TRUE(std::all_of(border, bytes.end(), [](uint8_t byte) { return byte == 0x5A; }));
    }
    // Queries of views that are not drawn return NaN.
    DeviceUpload<VisibilityQuery> query_copy;
    std::vector<VisibilityQuery> host_queries;
    for (int32_t agent = 0; agent < 30; ++agent) host_queries.insert(host_queries.end(), {{1, agent}, {3, agent}});
    const Span<const VisibilityQuery> queries = query_copy.assign(Span<const VisibilityQuery>(host_queries), nullptr);
    DeviceBuffer<float> answers(host_queries.size());
    const int32_t two = 2;
    count.copy_from_host(&two);
    std::vector<float> whole(host_queries.size()), counted(host_queries.size());
    stage.renderer->visibility(stage.scene.batch(), stage.views, queries, {answers.data(), answers.size()});
    answers.copy_to_host(whole.data());
    stage.renderer->visibility(stage.scene.batch(), {stage.views, count.data()}, queries,
                               {answers.data(), answers.size()});
    answers.copy_to_host(counted.data());
    stage.renderer->check();
    for (std::size_t i = 0; i < counted.size(); ++i) {
      EXPECT_EQ(std::isnan(counted[i]), host_queries[i].view == 3 || std::isnan(whole[i])) << i;
      if (!std::isnan(counted[i])) {
        EXPECT_EQ(counted[i], whole[i]) << i;
      }
    }
  }
}

TEST_F(CudaStreamTest, MapsAreReplacedWithoutWaitingForTheDevice) {
  Stage stage(60, 4, {.rig = paper_rig()});
  const std::vector<uint8_t> expected = bytes_of(stage.draw());
  const StaticGeometry other = make_synthetic_town(8, 60).geometry;
  const OwnStream own, busy_stream;
  const Stream stream{own.stream};
  auto replace = [&] {
    stage.renderer->upload(1, other, stream);
    stage.renderer->release(1, stream);
    stage.renderer->check(stream);
    stage.renderer->upload(1, stage.town.geometry, stream);
    stage.renderer->upload(1, other, stream);
  };
  replace();
  replace();  // all memory that it needs at a time is allocated now
  stage.renderer->reserve(4, static_cast<int>(stage.town.scene.agents.size()));
  const uint64_t generation = stage.renderer->generation();
  Blocker busy(busy_stream.stream);
  for (int repeat = 0; repeat < 5; ++repeat) replace();
  EXPECT_EQ(cudaStreamQuery(busy_stream.stream), cudaErrorNotReady) << "waited for another stream";
  busy.release();
  PICTURA_CUDA(cudaDeviceSynchronize());
  EXPECT_TRUE(busy.was_released());
  EXPECT_EQ(stage.renderer->generation(), generation);

  // A captured graph draws the map that the handle holds at the replay.
  HostImages host = stage.host_images();
  const ImageBatch batch = stage.images.like(host.batch());
  PICTURA_CUDA(cudaDeviceSynchronize());
  const CapturedGraph graph(own.stream,
                            [&] { stage.renderer->render(stage.scene.batch(), stage.views, batch, stream); });
  auto replay = [&] {
    PICTURA_CUDA(cudaGraphLaunch(graph.executable, own.stream));
    stage.renderer->check(stream);
    stage.images.copy_to_host(host.batch());
    PICTURA_CUDA(cudaDeviceSynchronize());
    return bytes_of(host);
  };
  EXPECT_EQ(replay(), expected);
  stage.renderer->upload(0, other, stream);
  EXPECT_NE(replay(), expected);
  stage.renderer->release(0, stream);
  EXPECT_THAT(test::message_of(replay), HasSubstr("its world has no such geometry"));
  stage.renderer->upload(0, stage.town.geometry, stream);
  EXPECT_EQ(replay(), expected);
}

TEST_F(CudaStreamTest, DrawsTheSameInPartsUnderATightBound) {
  const RendererConfig config{.rig = paper_rig()};
  Stage whole(60, 7, config);
  RendererConfig tight = config;
  tight.max_scratch_bytes = min_scratch_bytes(60, 7, config) + 40;
  Stage parts(60, 7, tight);
  EXPECT_EQ(bytes_of(parts.draw()), bytes_of(whole.draw()));
  // A fault states the view's index in the batch, not in its part.
  parts.town.views[5].world = 9;
  parts.views = parts.view_copy.assign(Span<const View>(parts.town.views), nullptr);
  parts.draw();
  EXPECT_THAT(test::message_of([&] { parts.draw(); }), HasSubstr("view 5: no such world"));
}

TEST_F(CudaStreamTest, AnOutOfMemoryCallDoesNotAffectLaterCalls) {
  RendererConfig config{.rig = paper_rig()};
  config.max_scratch_bytes = min_scratch_bytes(5, 1, config);
  Stage stage(5, 1, config);
  const std::vector<uint8_t> first = bytes_of(stage.draw());
  const DeviceScene crowded(make_synthetic_town(7, 120).scene.batch());
  HostImages host = stage.host_images();
  EXPECT_THAT(
      test::message_of([&] { stage.renderer->render(crowded.batch(), stage.views, stage.images.like(host.batch())); }),
      HasSubstr("max_scratch_bytes"));
  EXPECT_EQ(bytes_of(stage.draw()), first);
}

TEST_F(CudaStreamTest, KernelsBuiltAheadOfTimeDrawTheSame) {
  Rig mixed = paper_rig(50, 30);
  mixed.cameras[1] = paper_rig(31, 17).cameras[1];
  for (const Rig& rig : {paper_rig(), mixed}) {
    RendererConfig config{.rig = rig, .device = {MemorySpace::cuda, 0}};
    const test::EnvironmentVariable on("PICTURA_NVRTC", std::nullopt);
    std::string choice;
    make_renderer("cuda", config, &choice);
    EXPECT_THAT(choice, StartsWith("cuda: requested; kernels built"));
    EXPECT_THAT(choice, HasSubstr("and this rig"));
    const std::vector<uint8_t> at_run_time = bytes_of(Stage(60, 7, config).draw(PixelFormat::f32));
    const test::EnvironmentVariable off("PICTURA_NVRTC", "off");
    make_renderer("cuda", config, &choice);
    EXPECT_THAT(choice, HasSubstr("kernels built ahead of time"));
    EXPECT_EQ(bytes_of(Stage(60, 7, config).draw(PixelFormat::f32)), at_run_time);
  }
}

}  // namespace
}  // namespace pictura
