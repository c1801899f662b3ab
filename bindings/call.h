// How Python calls the library: without the GIL, one thread at a time for each object, and never in a process that was
// forked from one whose threads or CUDA it would need.
#pragma once

#include <atomic>
#include <chrono>
#include <csignal>
#include <exception>
#include <functional>
#include <future>
#include <memory>
#include <string_view>
#include <thread>
#include <utility>

#include <pybind11/pybind11.h>

#include "pictura/common/device.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"

namespace pictura::python {

namespace py = pybind11;

/// Throws Error in a child of fork() where the parent had begun threads or used CUDA, and this call needs them: both
/// are gone in the child, and waiting for them would never end.
void check_process(std::string_view what, int num_threads, Device device);

/// Lets go of the GIL for as long as it lives. A thread that wants it back while the interpreter ends is ended by
/// Python before 3.14 through an exception that no destructor may let out: it waits for the end of the process, as
/// from 3.14 on.
class WithoutGil {
 public:
  WithoutGil() : state_(PyEval_SaveThread()) {}
  WithoutGil(const WithoutGil&) = delete;
  WithoutGil& operator=(const WithoutGil&) = delete;
  ~WithoutGil() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    }
  }

 private:
  PyThreadState* state_;
};

/// Makes methods of a module's classes refuse objects that were made by __new__ alone, which have nothing in C++:
/// pybind11 would hand them memory that nobody has written. For the end of a module's definition.
void refuse_unmade_objects(const py::module_& module);

/// Makes objects of a module's classes pickle by protocol 2 where 0 or 1 is asked for: those copy the part of an object
/// that belongs to pybind11's own base class, which ends the process. For the end of a module's definition.
void pickle_by_new_protocols(const py::module_& module);

/// Lets one thread at a time into calls of an object.
class Turnstile {
 public:
  /// In a call for as long as it lives. Throws Error where another thread is in one.
  class Pass {
   public:
    Pass(Turnstile* turnstile, std::string_view what) : turnstile_(turnstile) {
      PICTURA_CHECK(!turnstile->is_taken_.exchange(true),
                    "{}: another thread is in a call of this object, which serves one at a time", what);
    }
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;
    ~Pass() { turnstile_->is_taken_ = false; }

   private:
    Turnstile* turnstile_;
  };

 private:
  std::atomic<bool> is_taken_{false};
};

/// Of one object of the library. An object serves one thread at a time.
class Calls {
 public:
  /// num_threads as the library takes it; 0: all.
  Calls(int num_threads, Device device) : num_threads_(num_threads), device_(device) {}

  /// Runs `work` without the GIL. Throws Error where another thread is in a call of the same object.
  template <typename Work>
  auto run(std::string_view what, Work&& work) {
    check_process(what, num_threads_, device_);
    const Turnstile::Pass pass(turnstile_.get(), what);
    const WithoutGil no_gil;
    return std::forward<Work>(work)();
  }

  /// For calls of the same object by others that hold it.
  const std::shared_ptr<Turnstile>& turnstile() const { return turnstile_; }

 private:
  int num_threads_;
  Device device_;
  std::shared_ptr<Turnstile> turnstile_ = std::make_shared<Turnstile>();
};

/// Runs long work in a thread of its own and returns its result; the caller's thread meanwhile answers ^C, and then
/// raises KeyboardInterrupt while the work, whose result nobody takes, ends in the background. The work must own all
/// that it reads.
template <typename Work>
auto run_interruptibly(std::string_view what, int num_threads, Device device, Work work) {
  using Result = decltype(work());
  check_process(what, num_threads, device);
  auto task = std::make_shared<std::packaged_task<Result()>>(std::move(work));
  std::future<Result> result = task->get_future();
  std::thread([task = std::move(task)] { (*task)(); }).detach();
  for (;;) {
    {
      const WithoutGil no_gil;
      if (result.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready) break;
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return result.get();
}

/// Runs long work, which checks interrupted() between its steps, in a thread of its own. ^C ends it in order, as it
/// ends the command, and then raises KeyboardInterrupt. The work may call back into Python.
template <typename Work>
auto run_to_an_orderly_end(std::string_view what, int num_threads, Device device, Work work) {
  check_process(what, num_threads, device);
  std::exception_ptr raised;
  auto result = std::async(std::launch::async, std::move(work));
  for (;;) {
    {
      const WithoutGil no_gil;
      if (result.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready) break;
    }
    if (!raised && PyErr_CheckSignals() != 0) {
      raised = std::make_exception_ptr(py::error_already_set());
      take_interrupt(SIGINT);
    }
  }
  if (raised) {
    forget_interrupt();
    std::rethrow_exception(raised);
  }
  return result.get();
}

}  // namespace pictura::python
