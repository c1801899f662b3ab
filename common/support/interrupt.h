// Handling of ^C and of termination signals: long work polls for them between its steps instead of dying at once.
#pragma once

#include <string>
#include <utility>

namespace pictura {

/// Records the first SIGINT, SIGTERM or SIGHUP from now on. A second SIGINT or SIGTERM ends the process at once with
/// status 128 + its number. SIGHUP stays ignored where it already is (nohup).
void catch_interrupts();

/// Returns the first signal, or 0. Always 0 unless catch_interrupts() or record_interrupt() was called.
int interrupting_signal();

/// Records a signal if none is recorded: another process that cooperates with this one received it.
void record_interrupt(int signal);

/// Clears the recorded signal, for a process that continues after it has ended the interrupted work.
void clear_interrupt();

inline bool interrupted() { return interrupting_signal() != 0; }
/// Throws Interrupted if a signal is recorded.
void throw_if_interrupted();

/// A piece of work that a signal stops, unless a signal came before the work began: work that begins after a signal is
/// part of an orderly end, such as plotting the curve learnt so far.
class InterruptibleWork {
 public:
  /// `message` describes the interrupted work.
  explicit InterruptibleWork(std::string message) : message_(std::move(message)) {}
  /// Throws Interrupted if a signal came after the work began.
  void check() const;

 private:
  std::string message_;
  bool began_after_ = interrupted();
};

}  // namespace pictura
