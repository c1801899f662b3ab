#include "pictura/training/repeated_work.h"

#include <gmock/gmock.h>

#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using Mode = RepeatedWork::Mode;
using test::message_of;
using ::testing::HasSubstr;

TEST(RepeatedWork, RunsAsCallsUntilMemoryIsStableAndIsThenCaptured) {
  const Graphs graphs(Device{}, /*are_used=*/true);
  RepeatedWork work;
  for (int i = 0; i < 3; ++i) EXPECT_EQ(work.next_mode(graphs, /*is_settled=*/false), Mode::calls);
  EXPECT_EQ(work.next_mode(graphs, true), Mode::calls);
  EXPECT_EQ(work.next_mode(graphs, false), Mode::calls);
  EXPECT_EQ(work.next_mode(graphs, true), Mode::capture);
  EXPECT_FALSE(work.is_captured());
}

TEST(RepeatedWork, RunsAsCallsWithoutGraphs) {
  Graphs graphs(Device{}, /*are_used=*/false);
  RepeatedWork work;
  int times = 0;
  for (int i = 0; i < 5; ++i) work.run(&graphs, [&times] { ++times; });
  EXPECT_EQ(times, 5);
  EXPECT_EQ(graphs.num_launches(), 0);
}

TEST(RepeatedWork, CaptureErrorsNameTheKey) {
  Graphs graphs(Device{}, /*are_used=*/true);
  RepeatedWork work;
  int times = 0;
  const auto run = [&] { work.run(&graphs, [&times] { ++times; }); };
  run();
  EXPECT_THAT(message_of(run), HasSubstr("train.graphs = \"off\""));
  EXPECT_EQ(times, 1);
}

}  // namespace
}  // namespace pictura
