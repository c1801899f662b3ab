#include "pictura/common/support/interrupt.h"

#include <csignal>
#include <ctime>

#include <unistd.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {
// Process-wide variables of the library, because a signal handler cannot reach other state.
volatile std::sig_atomic_t first_signal = 0;
volatile std::time_t first_came_ms = 0;

std::time_t now_ms() {
  timespec now{};
  clock_gettime(CLOCK_MONOTONIC, &now);
  return now.tv_sec * 1000 + now.tv_nsec / 1000000;
}

extern "C" void on_interrupt(int signal) {
  if (!first_signal) {
    first_came_ms = now_ms();
    first_signal = signal;
    return;
  }
  // One request may arrive as two signals: timeout(1) signals its child and then the child's group, and both the shell
  // and the kernel report a terminal that hangs up.
  constexpr std::time_t kSameRequest_ms = 100;
  if (signal != SIGHUP && now_ms() - first_came_ms > kSameRequest_ms) _exit(128 + signal);
}
}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
  if (std::signal(SIGHUP, on_interrupt) == SIG_IGN) std::signal(SIGHUP, SIG_IGN);
}

void record_interrupt(int signal) {
  if (first_signal) return;
  first_came_ms = now_ms();  // this process may receive a signal of the same request a moment later
  first_signal = signal;
}

void clear_interrupt() { first_signal = 0; }

int interrupting_signal() { return first_signal; }

void throw_if_interrupted() {
  if (interrupted()) throw Interrupted("interrupted");
}

void InterruptibleWork::check() const {
  if (!began_after_ && interrupted()) throw Interrupted(message_);
}

}  // namespace pictura
