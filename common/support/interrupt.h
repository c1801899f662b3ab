// Handling of ^C and of termination signals: long work polls for a signal between its steps, instead of ending
// immediately.
#pragma once

#include <string>
#include <utility>

namespace pictura {

/// Records the first SIGINT, SIGTERM or SIGHUP from now on. A second SIGINT or SIGTERM ends the process immediately,
/// with status 128 + the signal's number. If SIGHUP is already ignored (nohup), it stays ignored.
void catch_interrupts();

/// Returns the number of the recorded signal, or 0. Always 0 unless catch_interrupts() or record_interrupt() was
/// called.
int interrupting_signal();

/// Records a signal that a cooperating process received, unless a signal is already recorded.
void record_interrupt(int signal);

/// Clears the recorded signal, for a process that continues after it has ended the interrupted work.
void clear_interrupt();

inline bool interrupted() { return interrupting_signal() != 0; }
/// Throws Interrupted if a signal is recorded.
void throw_if_interrupted();

/// A piece of work that a signal interrupts. Work that began after a signal is not interrupted, because it is part of
/// an orderly end, such as plotting the learning curve so far.
class InterruptibleWork {
 public:
  /// `message` describes the interrupted work.
  explicit InterruptibleWork(std::string message) : message_(std::move(message)) {}
  /// Throws Interrupted if the first signal came after the work began.
  void check() const;

 private:
  std::string message_;
  bool began_after_ = interrupted();
};

}  // namespace pictura
