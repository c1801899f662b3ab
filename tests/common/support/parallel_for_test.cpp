// parallel_for() visits every item once, rethrows the exception of the lowest item, and uses only as many threads as it
// needs. Idle threads sleep.
#include "pictura/common/support/parallel_for.h"

#include <atomic>
#include <chrono>
#include <ctime>
#include <set>
#include <stdexcept>
#include <string>
#include <thread>
#include <vector>

#include <gtest/gtest.h>
#include <sys/wait.h>
#include <unistd.h>

namespace pictura {
namespace {

TEST(ParallelFor, VisitsEveryItemOnce) {
  for (const int threads : {0, 1, 3}) {
    std::vector<int> visits(1000, 0);
    parallel_for(threads, 1000, [&](std::int64_t i) { ++visits[i]; });
    EXPECT_EQ(visits, std::vector<int>(1000, 1));
  }
}

TEST(ParallelFor, RethrowsTheLowestItemsException) {
  try {
    parallel_for(3, 100, [](std::int64_t i) {
      if (i >= 40) throw std::runtime_error(std::to_string(i));
    });
    FAIL() << "expected an exception";
  } catch (const std::runtime_error& error) {
    EXPECT_STREQ(error.what(), "40");
  }
}

TEST(ParallelFor, GivesConcurrentThreadsDifferentNumbers) {
  constexpr int kThreads = 4;
  std::vector<std::atomic<int>> at_work(kThreads);
  std::atomic<int> twice = 0;
  for (int loop = 0; loop < 200; ++loop) {
    parallel_for(kThreads, 20, [&](std::int64_t, int thread) {
      std::atomic<int>& own = at_work.at(static_cast<std::size_t>(thread));
      twice += own.fetch_add(1) != 0;
      --own;
    });
  }
  EXPECT_EQ(twice, 0);
}

TEST(ParallelFor, UsesNoMoreThreadsThanItems) {
  std::thread::id only;
  parallel_for(4, 1, [&](std::int64_t, int thread) {
    EXPECT_EQ(thread, 0);
    only = std::this_thread::get_id();
  });
  EXPECT_EQ(only, std::this_thread::get_id());
  parallel_for(4, 2, [](std::int64_t, int thread) { EXPECT_LT(thread, 2); });
  parallel_for(4, 0, [](std::int64_t) { FAIL(); });
}

TEST(ParallelFor, RunsNestedAndConcurrentLoops) {
  std::atomic<int> visits = 0;
  const auto run = [&] {
    parallel_for(3, 10, [&](std::int64_t) {
      const auto own = std::this_thread::get_id();
      parallel_for(3, 10, [&](std::int64_t) {
        EXPECT_EQ(std::this_thread::get_id(), own);
        ++visits;
      });
    });
  };
  std::thread other(run);
  run();
  other.join();
  EXPECT_EQ(visits, 200);
}

TEST(ParallelFor, RunsInForkedProcesses) {
  const auto count = [] {
    std::atomic<int> visits = 0;
    parallel_for(3, 100, [&](std::int64_t) { ++visits; });
    return visits.load();
  };
  ASSERT_EQ(count(), 100);
  const pid_t child = fork();
  if (child == 0) _exit(count() == 100 ? 0 : 1);
  int status = -1;
  ASSERT_EQ(waitpid(child, &status, 0), child);
  EXPECT_EQ(status, 0);
}

TEST(ParallelFor, SleepsBetweenLoops) {
  const auto cpu_s = [] {
    timespec now{};
    clock_gettime(CLOCK_PROCESS_CPUTIME_ID, &now);
    return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
  };
  constexpr int kLoops = 100;
  static constexpr std::chrono::milliseconds kGap{2};
  const double begin_s = cpu_s();
  for (int loop = 0; loop < kLoops; ++loop) {
    // The first thread makes the others wait at the end as well.
    parallel_for(3, 3, [](std::int64_t i) {
      if (i == 0) std::this_thread::sleep_for(kGap);
    });
    std::this_thread::sleep_for(kGap);
  }
  const double gaps_s = 2e-3 * 2 * kLoops;  // per thread, of three threads
  EXPECT_LT(cpu_s() - begin_s, gaps_s / 4);
}

}  // namespace
}  // namespace pictura
