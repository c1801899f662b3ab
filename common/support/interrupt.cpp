#include "pictura/common/support/interrupt.h"

#include <csignal>

namespace pictura {

namespace {
// The one process-wide variable of the library: a signal handler can reach nothing else.
volatile std::sig_atomic_t interrupt_seen = 0;

extern "C" void on_interrupt(int signal) {
  if (interrupt_seen) {
    std::signal(signal, SIG_DFL);
    std::raise(signal);
  }
  interrupt_seen = 1;
}
}  // namespace

void catch_interrupts() {
  std::signal(SIGINT, on_interrupt);
  std::signal(SIGTERM, on_interrupt);
}

bool interrupted() { return interrupt_seen != 0; }

}  // namespace pictura
