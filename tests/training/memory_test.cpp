// The memory that agents take, by estimate: near what they do take, and refused where there is less.
#include "pictura/training/memory.h"

#include <gmock/gmock.h>
#include <malloc.h>

#include "pictura/tests/support/error_message.h"
#include "pictura/training/run.h"

namespace pictura {
namespace {

using test::message_of;
using ::testing::AllOf;
using ::testing::HasSubstr;

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

// By a run that is ready to collect.
double taken_bytes(const Config& config) {
  const double before = heap_bytes();
  const Run run(config, Device{});
  run.simulator->reset();
  const std::unique_ptr<StateSnapshot> snapshot = run.simulator->snapshot();
  return heap_bytes() - before;
}

class EachRollout : public testing::TestWithParam<std::pair<const char*, const char*>> {};
INSTANTIATE_TEST_SUITE_P(Memory, EachRollout,
                         testing::Values(std::pair{"vector", "auto"}, std::pair{"perspective", "kept"},
                                         std::pair{"perspective", "redrawn"}),
                         [](const auto& test) { return std::string(test.param.first) + "_" + test.param.second; });

TEST_P(EachRollout, TakesAboutWhatIsEstimated) {
  const auto config = [](int num_slots) { return config_of(GetParam().first, GetParam().second, num_slots); };
  const Config few = config(1000), many = config(3000);
  taken_bytes(few);  // what is made once
  const double per_agent = (taken_bytes(many) - taken_bytes(few)) / 2000,
               by_estimate = (estimated_bytes(many, Device{}) - estimated_bytes(few, Device{})) / 2000;
  EXPECT_GT(by_estimate, 0.95 * per_agent) << per_agent << " bytes";
  EXPECT_LT(by_estimate, 1.2 * per_agent) << per_agent << " bytes";
}

TEST(Memory, MoreAgentsThanFitAreRefusedWithTheNumberThatWould) {
  const auto config = [](int num_slots) { return config_of("perspective", "kept", num_slots); };
  const auto memory_bytes = static_cast<int64_t>(estimated_bytes(config(250), Device{})) + 1;
  EXPECT_NO_THROW(check_memory(config(250), Device{}, memory_bytes));
  EXPECT_ANY_THROW(check_memory(config(251), Device{}, memory_bytes));
  EXPECT_THAT(message_of([&] { check_memory(config(1000), Device{}, memory_bytes); }),
              AllOf(HasSubstr("1000 agents (simulator.num_slots)"), HasSubstr("2 steps (train.num_steps)"),
                    HasSubstr("by estimate"), HasSubstr("cpu has"), HasSubstr("about 250 agents would fit")));
}

}  // namespace
}  // namespace pictura
