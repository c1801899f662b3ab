// Handling of ^C and termination signals. Long work polls for a recorded signal between its steps.
#pragma once

#include <string>
#include <utility>

namespace pictura {

/// Records the first SIGINT, SIGTERM or SIGHUP from now on. A later SIGINT or SIGTERM ends the process with status 128
/// + the signal's number. An ignored SIGHUP (nohup) stays ignored.
void catch_interrupts();

/// Returns the number of the recorded signal, or 0.
int interrupting_signal();

/// Records a signal of a cooperating process, unless a signal is already recorded.
void record_interrupt(int signal);

/// Clears the recorded signal, for a process that continues.
void clear_interrupt();

inline bool interrupted() { return interrupting_signal() != 0; }
void throw_if_interrupted();

/// Work that a signal interrupts. Work that begins after the signal is part of the shutdown, and is not interrupted.
class InterruptibleWork {
 public:
  explicit InterruptibleWork(std::string message) : message_(std::move(message)) {}
  /// Throws Interrupted if the signal came after the work began.
  void check() const;

 private:
  std::string message_;
  bool began_after_ = interrupted();
};

}  // namespace pictura
