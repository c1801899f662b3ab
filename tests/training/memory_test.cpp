// Estimated memory of agents and network: close to the measured memory, and rejected if less is available.
#include "pictura/training/memory.h"

#include <ATen/Parallel.h>
#include <c10/core/CPUAllocator.h>
#include <gmock/gmock.h>
#include <malloc.h>

#include "pictura/configuration/apply_config.h"
#include "pictura/map/load_map.h"
#include "pictura/policy/network_shape.h"
#include "pictura/tests/support/error_message.h"
#include "pictura/training/run.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;
using ::testing::Not;

Config config_of(const std::string& modality, const std::string& images, int num_slots) {
  return load_config(
      PICTURA_SOURCE_DIR "/configs/smoke.toml",
      {"run.device=cpu", "run.num_threads=1", "render.backend=cpu", "simulator.parked_cars=4", "train.num_steps=2",
       "policy.modality=" + modality, "train.images=" + images, "simulator.num_slots=" + std::to_string(num_slots)});
}

double heap_bytes() {
  const struct mallinfo2 info = mallinfo2();
  return static_cast<double>(info.uordblks + info.hblkhd);
}

// Bytes of a run that is ready to collect.
double taken_bytes(const Config& config) {
  const double before = heap_bytes();
  const Run run(config, Device{});
  run.simulator->reset();
  const std::unique_ptr<StateSnapshot> snapshot = run.simulator->snapshot();
  return heap_bytes() - before;
}

class EachRollout : public ::testing::TestWithParam<std::pair<const char*, const char*>> {};
INSTANTIATE_TEST_SUITE_P(Memory, EachRollout,
                         ::testing::Values(std::pair{"vector", "auto"}, std::pair{"perspective", "kept"},
                                           std::pair{"perspective", "redrawn"}),
                         [](const auto& test) { return std::string(test.param.first) + "_" + test.param.second; });

TEST_P(EachRollout, UsesAboutTheEstimatedMemory) {
  const auto config = [](int num_slots) { return config_of(GetParam().first, GetParam().second, num_slots); };
  const Config few = config(1000), many = config(3000);
  const bool keeps = std::string(GetParam().second) != "redrawn";
  taken_bytes(few);  // one-time allocations
  const double per_agent = (taken_bytes(many) - taken_bytes(few)) / 2000,
               by_estimate = (estimated_bytes(many, keeps) - estimated_bytes(few, keeps)) / 2000;
  EXPECT_GT(by_estimate, 0.95 * per_agent) << per_agent << " bytes";
  EXPECT_LT(by_estimate, 1.2 * per_agent) << per_agent << " bytes";
}

TEST(Memory, ReplayedTracksOfScenesAreCounted) {
  Config config = config_of("vector", "auto", 240);
  config.simulator.min_agents = config.simulator.max_agents;
  const double in_towns = estimated_bytes(config, true);
  config.simulator.maps = {"scenes:any"};
  config.simulator.min_agents = 1;  // without effect: each world of a scene has max_agents slots
  config.simulator.scenes.max_replayed = config.simulator.parked_cars;
  EXPECT_EQ(estimated_bytes(config, true), in_towns);
  config.simulator.scenes.max_replayed += 96;
  EXPECT_GT(estimated_bytes(config, true), in_towns);
}

TEST(Memory, RecordedSceneEmbeddingsOfATeacherAreCounted) {
  for (const std::string modality : {"vector", "perspective"}) {
    Config config = config_of(modality, "kept", 240);
    config.train.teacher_scene_coef = 1;
    const double alone = estimated_bytes(config, true);
    config.train.teacher = "teacher.safetensors";
    const int64_t width = make_policy(config, rig_of(config), Device{})->scene_width();
    EXPECT_EQ(estimated_bytes(config, true) - alone, 240.0 * 2 * (width + kNumActions) * 4);
    config.train.teacher_scene_coef = 0;
    EXPECT_EQ(estimated_bytes(config, true) - alone, 240.0 * 2 * kNumActions * 4);
  }
}

TEST(Memory, ErrorsNameTheNumberOfAgentsThatFit) {
  const auto config = [](int num_slots) { return config_of("perspective", "kept", num_slots); };
  const Config any = config(250);
  const double network = network_size(any, Device{}).bytes(static_cast<double>(any.train.forward_chunk));
  const auto memory_bytes = static_cast<int64_t>(estimated_bytes(config(250), true) + network) + 1;
  EXPECT_NO_THROW(check_memory(config(250), Device{}, memory_bytes));
  EXPECT_ANY_THROW(check_memory(config(251), Device{}, memory_bytes));
  EXPECT_THAT(message_of([&] { check_memory(config(1000), Device{}, memory_bytes); }),
              AllOf(HasSubstr("1000 agents (simulator.num_slots)"), HasSubstr("2 steps (train.num_steps)"),
                    HasSubstr("by estimate"), HasSubstr("cpu has"), HasSubstr("about 250 agents would fit")));
}

class EachNetwork : public ::testing::TestWithParam<std::vector<std::string>> {
 protected:
  // Configuration whose update has one chunk of `transitions` transitions.
  Config config_of_chunk(int transitions) const {
    std::vector<std::string> overrides = GetParam();
    for (const char* key : {"train.forward_chunk", "train.minibatch_size"}) {
      overrides.push_back(fmt::format("{}={}", key, transitions));
    }
    overrides.insert(overrides.end(), {"run.device=cpu", "run.num_threads=1", "render.backend=cpu",
                                       "simulator.num_slots=512", "train.num_steps=4", "train.update_epochs=1"});
    return load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", overrides);
  }
};
INSTANTIATE_TEST_SUITE_P(
    Memory, EachNetwork,
    ::testing::Values(
        std::vector<std::string>{"policy.modality=vector"},
        std::vector<std::string>{"policy.modality=vector", "policy.point_features=false", "policy.embedding_width=200"},
        std::vector<std::string>{"policy.modality=vector", "policy.segment_features=true",
                                 "simulator.wall_observations=true"},
        std::vector<std::string>{"policy.modality=vector", "policy.layer_norm=true", "policy.residual=true"},
        std::vector<std::string>{"policy.modality=perspective"},
        std::vector<std::string>{"policy.modality=perspective", "policy.conv_norm=true"},
        std::vector<std::string>{"policy.modality=perspective", "policy.concatenate_queries=true"},
        std::vector<std::string>{"policy.modality=perspective", "policy.patch_px=1",
                                 "policy.conv_kernels=[5, 3, 3, 3, 3]", "policy.conv_strides=[2, 2, 2, 1, 1]"}));

TEST_P(EachNetwork, HasTheCountedParameters) {
  const Config config = config_of_chunk(64);
  EXPECT_EQ(network_size(config, Device{}).parameters, make_policy(config, rig_of(config), Device{})->num_parameters());
}

// Scope in which all host allocations of torch are counted. One at a time.
class CountedTensors final : public c10::Allocator {
 public:
  CountedTensors() : before_(c10::GetCPUAllocator()) {
    live_bytes_ = peak_bytes_ = 0;
    c10::SetCPUAllocator(this, kPriority);
  }
  ~CountedTensors() override { c10::SetCPUAllocator(before_, kPriority); }
  CountedTensors(const CountedTensors&) = delete;
  CountedTensors& operator=(const CountedTensors&) = delete;

  /// Peak bytes.
  static double peak_bytes() { return static_cast<double>(peak_bytes_); }

  c10::DataPtr allocate(size_t bytes) override {
    void* block = nullptr;
    if (posix_memalign(&block, kHead, kHead + bytes) != 0) throw std::bad_alloc();
    std::memcpy(block, &bytes, sizeof(bytes));
    live_bytes_ += static_cast<int64_t>(bytes);
    peak_bytes_ = std::max(peak_bytes_, live_bytes_);
    void* const data = static_cast<char*>(block) + kHead;
    return {data, data, &release, c10::Device(c10::kCPU)};
  }
  c10::DeleterFnPtr raw_deleter() const override { return &release; }
  void copy_data(void* to, const void* from, size_t bytes) const override { default_copy_data(to, from, bytes); }

 private:
  // Blocks freed after this scope store their own size.
  static void release(void* data) {
    void* const block = static_cast<char*>(data) - kHead;
    size_t bytes = 0;
    std::memcpy(&bytes, block, sizeof(bytes));
    live_bytes_ -= static_cast<int64_t>(bytes);
    std::free(block);
  }

  static constexpr size_t kHead = 64;  // vectors are aligned
  static constexpr uint8_t kPriority = 1;
  static inline int64_t live_bytes_ = 0, peak_bytes_ = 0;
  c10::Allocator* before_;
};

TEST_P(EachNetwork, ForwardAndBackwardUseAboutTheEstimatedMemory) {
  at::set_num_threads(1);  // the peak of several threads depends on their timing
  double taken[2];
  const int chunks[] = {256, 1024};  // sizes at which weights and gradients are small beside the counted memory
  for (size_t i = 0; i < std::size(chunks); ++i) {
    const Config config = config_of_chunk(chunks[i]);
    const std::unique_ptr<const Policy> policy = make_policy(config, rig_of(config), Device{});
    const Rig rig = rig_of(config);
    const CountedTensors counted;
    Observation observation = row_of(allocate_observations(config, 1, chunks[i], Device{}), 0);
    observation = observation.map([](const at::Tensor& t) { return at::zeros_like(t); });
    for (size_t j = 0; j < std::size(kObservationArrays); ++j) {
      const ObservationArray& array = kObservationArrays[j];
      if (is_set(array) && config.reads(array.part)) {
        observation.set_counts.select(1, static_cast<int64_t>(entity_set_of(j))).fill_(array.rows);
      }
    }
    if (config.reads_images()) {
      const int64_t height = rig.cameras[0].height_px, width = rig.cameras[0].width_px;
      observation.images = {{at::zeros({chunks[i], 4, 3, height, width}, at::kByte), {0, 1, 2, 3}}};
    }
    const Policy::Output output = policy->forward(observation);
    (output.logits.sum() + output.value.sum()).backward();
    taken[i] = counted.peak_bytes();
  }
  const double of_transition = (taken[1] - taken[0]) / (chunks[1] - chunks[0]),
               by_estimate = network_size(config_of_chunk(64), Device{}).transition_bytes;
  EXPECT_GT(by_estimate, 0.8 * of_transition) << of_transition << " bytes";
  EXPECT_LT(by_estimate, 1.6 * of_transition) << of_transition << " bytes";
}

TEST(Memory, ImagesAreKeptOnADeviceUpToTwoFifthsOfItsMemory) {
  const auto keeps = [](const std::vector<std::string>& overrides, int64_t memory_bytes,
                        Device device = {MemorySpace::cuda}) {
    return keeps_images(load_config(PICTURA_SOURCE_DIR "/configs/paper.toml", overrides), 1000, device, memory_bytes);
  };
  // 1,000 agents, 129 steps, four images of 96x54 with three channels.
  const int64_t bytes = int64_t{1000} * 129 * 4 * 96 * 54 * 3;
  EXPECT_TRUE(keeps({}, bytes / 2 * 5));
  EXPECT_FALSE(keeps({}, bytes / 2 * 5 - 5));
  // An action that is held for four steps has one image: at steps 0, 4, ..., 128.
  EXPECT_TRUE(keeps({"policy.decision_steps=4"}, bytes / 129 * 33 / 2 * 5));
  EXPECT_FALSE(keeps({"policy.decision_steps=4"}, bytes / 129 * 33 / 2 * 5 - 5));
  EXPECT_TRUE(keeps({}, 1, Device{}));
  EXPECT_TRUE(keeps({"train.images=kept"}, 1));
  EXPECT_FALSE(keeps({"train.images=redrawn"}, 100 * bytes));
  // The largest images that the run will draw count.
  EXPECT_FALSE(keeps({"render.schedule=[[1000, 192, 108]]"}, 9 * bytes));
  EXPECT_TRUE(keeps({"render.schedule=[[1000, 192, 108]]"}, 10 * bytes));
}

TEST(Memory, TheEstimateOfMapsIsATightUpperBound) {
  const std::vector<std::string> names{"procedural:1", "procedural:1#1", "procedural:2:blocks=2x2", "procedural:5",
                                       "city:1"};
  const MapMemory estimate = estimated_map_memory(names);
  const double before = heap_bytes();
  const CompiledMaps maps = compile_maps(load_maps(names, 1), {}, 1);
  const double host_bytes = heap_bytes() - before;
  double device_bytes = 0;
  for (const auto& map : maps) device_bytes += static_cast<double>(map->rules.size_bytes());
  EXPECT_GT(estimate.host, host_bytes);
  EXPECT_LT(estimate.host, 3 * host_bytes);
  EXPECT_GT(estimate.device, device_bytes);
  EXPECT_LT(estimate.device, 3 * device_bytes);
}

TEST(Memory, ErrorsNameTheNumberOfMapsThatFit) {
  const auto config = [](int copies) {
    return load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml",
                       {"run.device=cpu", "simulator.maps=[\"procedural:1-4\"]", "simulator.num_slots=4000",
                        "simulator.max_agents=8", fmt::format("simulator.map_copies={}", copies)});
  };
  constexpr int64_t kPlenty_bytes = 64'000'000'000;
  EXPECT_NO_THROW(check_map_memory(config(9), Device{}, kPlenty_bytes, kPlenty_bytes));
  const double one_map = estimated_map_memory({"procedural:1"}).host, agents = estimated_bytes(config(0), true),
               network = network_size(config(0), Device{})
                             .bytes(std::min(config(0).train.forward_chunk, config(0).train.minibatch_size));
  const auto memory_bytes = static_cast<int64_t>(10.5 * one_map + agents + network);
  EXPECT_NO_THROW(check_map_memory(config(0), Device{}, memory_bytes, 0));
  EXPECT_THAT(message_of([&] { check_map_memory(config(9), Device{}, memory_bytes, 0); }),
              AllOf(HasSubstr("40 maps (simulator.maps, and simulator.map_copies of each)"), HasSubstr("by estimate"),
                    HasSubstr("cpu has"), HasSubstr("about 10 such maps would fit")));
  // A device holds less of a map than the host, which holds it as well.
  EXPECT_THAT(
      message_of([&] { check_map_memory(config(9), Device{MemorySpace::cuda, 0}, kPlenty_bytes, memory_bytes); }),
      HasSubstr("cpu has"));
}

TEST(Memory, AnOversizedNetworkIsRefusedBeforeAllocation) {
  const auto complaint = [](const std::vector<std::string>& overrides) {
    const Config config = load_config(PICTURA_SOURCE_DIR "/configs/smoke.toml", overrides);
    return message_of([&] { check_memory(config, Device{}, 64'000'000'000); });
  };
  EXPECT_EQ(complaint({}), test::kNoError);
  EXPECT_THAT(complaint({"policy.backbone_width=16384", "policy.backbone_layers=16"}),
              AllOf(HasSubstr("million parameters"), HasSubstr("cpu has 64 GB"), HasSubstr("it does not fit"),
                    Not(HasSubstr("\n"))));
  EXPECT_THAT(complaint({"policy.modality=perspective", "train.forward_chunk=1000000", "train.minibatch_size=1000000",
                         "policy.patch_px=1"}),
              AllOf(HasSubstr("1000000 transitions at once (train.forward_chunk)"), HasSubstr("transitions would fit"),
                    Not(HasSubstr("\n"))));
}

}  // namespace
}  // namespace pictura
