// The loop that drives simulators: its calls, their order, and the conditions that end the loop.
#include "pictura/simulator/drive_steps.h"

#include <cctype>
#include <csignal>
#include <string>

#include <gtest/gtest.h>

#include "pictura/backends/make_controller.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/load_map.h"
#include "pictura/tests/simulator/cpu_simulator.h"

namespace pictura::testing {
namespace {

std::unique_ptr<Simulator> town() {
  return make({.seed = 3, .num_threads = 1, .parked_cars = 0}, load_map("procedural:3"), {{0, 3, 0}});
}

/// Writes its letter before a step and again, as a capital, after it.
class Letter final : public StepObserver {
 public:
  Letter(char letter, std::string* text) : letter_(letter), text_(*text) {}
  void before_step(Span<const Command>) override { text_ += letter_; }
  void after_step(const StepResult&) override { text_ += static_cast<char>(std::toupper(letter_)); }

 private:
  const char letter_;
  std::string& text_;
};

TEST(DriveSteps, ActsStepsAndReportsUntilAnActReturnsFalse) {
  const auto simulator = town();
  std::vector<Command> commands(3);
  std::string text;
  Letter a('a', &text), b('b', &text);
  const auto act = [&](int step) {
    if (step == 2) return false;
    text += std::to_string(step);
    return true;
  };
  const auto on_step = [&](int step, const StepResult& result) {
    EXPECT_EQ(result.reward.size(), 3);
    text += std::to_string(step) + ' ';
  };
  const DriveEnd end = drive_steps(*simulator, commands, 5, act, {&a, &b}, on_step);
  EXPECT_EQ(text, "0abBA0 1abBA1 ");
  EXPECT_EQ(end.steps, 2);
  EXPECT_FALSE(end.is_interrupted);
  EXPECT_EQ(simulator->totals().slot_steps, 6);
}

TEST(DriveSteps, DrivingWithAControllerEqualsSingleSteps) {
  const auto simulator = town(), same = town();
  const auto controller = make_controller("random", *simulator, 7),
             same_controller = make_controller("random", *same, 7);
  EXPECT_EQ(drive_steps(*simulator, *controller, 20).steps, 20);
  std::vector<Command> commands(3);
  for (int step = 0; step < 20; ++step) {
    same_controller->act(same->arrays(), {}, commands);
    same->step(commands);
  }
  EXPECT_EQ(simulator->state_hash(), same->state_hash());
}

TEST(DriveSteps, AnInterruptEndsItBeforeTheNextAct) {
  const auto simulator = town();
  std::vector<Command> commands(3);
  const auto act = [](int step) {
    if (step == 1) record_interrupt(SIGINT);
    return true;
  };
  const DriveEnd end = drive_steps(*simulator, commands, 5, act);
  clear_interrupt();
  EXPECT_EQ(end.steps, 2);
  EXPECT_TRUE(end.is_interrupted);
}

}  // namespace
}  // namespace pictura::testing
