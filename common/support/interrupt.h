// ^C, and what else asks a process to end, as a question that long work asks between its steps, instead of a sudden
// death.
#pragma once

#include <string>
#include <utility>

namespace pictura {

/// From now on the first SIGINT, SIGTERM or SIGHUP is kept; a second SIGINT or SIGTERM ends the process at once with
/// the status 128 + its number. SIGHUP stays ignored where it is (nohup).
void catch_interrupts();

/// The signal that came first, or 0. Never another unless catch_interrupts() was called.
int interrupting_signal();

/// As if this signal had come, where none has: another process that this one works with got it.
void take_interrupt(int signal);

/// For a process that goes on after it has ended what was interrupted.
void forget_interrupt();

inline bool interrupted() { return interrupting_signal() != 0; }
/// Throws Interrupted where one has come.
void throw_if_interrupted();

/// A piece of work that a signal stops. One that came before the work began does not: then the work is part of an
/// orderly end, such as the curve of what was learnt until now.
class InterruptibleWork {
 public:
  /// `message` says what was interrupted.
  explicit InterruptibleWork(std::string message) : message_(std::move(message)) {}
  /// Throws Interrupted.
  void check() const;

 private:
  std::string message_;
  bool began_after_ = interrupted();
};

}  // namespace pictura
