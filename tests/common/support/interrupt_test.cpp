// Signals that end a process: the first is recorded, and a second signal shortly afterwards does not count as a second
// request.
#include "pictura/common/support/interrupt.h"

#include <csignal>

#include <gtest/gtest.h>

#include "pictura/common/error.h"

namespace pictura {
namespace {

class Interrupts : public ::testing::Test {
 protected:
  void SetUp() override {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) before_[signal] = std::signal(signal, SIG_DFL);
    clear_interrupt();
    catch_interrupts();
  }
  void TearDown() override {
    for (const int signal : {SIGINT, SIGTERM, SIGHUP}) std::signal(signal, before_[signal]);
    clear_interrupt();
  }

 private:
  void (*before_[NSIG])(int) = {};
};

TEST_F(Interrupts, TheFirstSignalIsKept) {
  EXPECT_FALSE(interrupted());
  std::raise(SIGTERM);
  std::raise(SIGINT);
  EXPECT_EQ(interrupting_signal(), SIGTERM);
  clear_interrupt();
  EXPECT_FALSE(interrupted());
}

// Each of several cooperating processes gets the signal from the others and, a moment later, directly.
TEST_F(Interrupts, ASignalAnnouncedByAnotherProcessCountsOnce) {
  record_interrupt(SIGTERM);
  std::raise(SIGTERM);
  EXPECT_EQ(interrupting_signal(), SIGTERM);
}

TEST_F(Interrupts, ASignalStopsOnlyWorkThatBeganBeforeIt) {
  const InterruptibleWork before("drawing was interrupted");
  EXPECT_NO_THROW(before.check());
  std::raise(SIGINT);
  EXPECT_THROW(before.check(), Interrupted);
  EXPECT_NO_THROW(InterruptibleWork("").check());
}

}  // namespace
}  // namespace pictura
