// Python's calls of the library, which run without the GIL.
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

/// Throws Error in a child of fork() if this call needs threads or CUDA and the parent has used them. The child has
/// neither, and would wait forever.
void check_process(std::string_view what, int num_threads, Device device);

/// Scope without the GIL. At interpreter shutdown, Python before 3.14 throws an exception, which must not leave the
/// destructor. The thread then waits for the end of the process, as in later Pythons.
class GilRelease {
 public:
  GilRelease() : state_(PyEval_SaveThread()) {}
  GilRelease(const GilRelease&) = delete;
  GilRelease& operator=(const GilRelease&) = delete;
  ~GilRelease() {
    try {
      PyEval_RestoreThread(state_);
    } catch (...) {
      for (;;) std::this_thread::sleep_for(std::chrono::hours(1));
    }
  }

 private:
  PyThreadState* state_;
};

/// Makes methods reject objects that __new__ created without __init__. Otherwise pybind11 passes uninitialised memory
/// to them. Call at the end of a module's definition.
void reject_uninitialized_objects(const py::module_& module);

/// Uses pickle protocol 2 instead of 0 and 1, with which Python crashes on pybind11's base class. Call at the end of a
/// module's definition.
void pickle_by_new_protocols(const py::module_& module);

/// Allows only one thread at a time to call an object.
class SingleCallGuard {
 public:
  /// The constructor throws Error if another thread is in a call.
  class Pass {
   public:
    Pass(SingleCallGuard* call_guard, std::string_view what) : call_guard_(call_guard) {
      PICTURA_CHECK(!call_guard->is_taken_.exchange(true),
                    "{}: another thread is in a call of this object, which serves one at a time", what);
    }
    Pass(const Pass&) = delete;
    Pass& operator=(const Pass&) = delete;
    ~Pass() { call_guard_->is_taken_ = false; }

   private:
    SingleCallGuard* call_guard_;
  };

 private:
  std::atomic<bool> is_taken_{false};
};

/// Runs calls of one library object.
class Calls {
 public:
  /// num_threads: threads that the object uses; 0: all.
  Calls(int num_threads, Device device) : num_threads_(num_threads), device_(device) {}

  /// Runs `work` without the GIL. Throws Error if another thread is in a call of the object.
  template <typename Work>
  auto run(std::string_view what, Work&& work) {
    check_process(what, num_threads_, device_);
    const SingleCallGuard::Pass pass(call_guard_.get(), what);
    const GilRelease no_gil;
    return std::forward<Work>(work)();
  }

  /// Shared with other objects that call the same library object.
  const std::shared_ptr<SingleCallGuard>& call_guard() const { return call_guard_; }

 private:
  int num_threads_;
  Device device_;
  std::shared_ptr<SingleCallGuard> call_guard_ = std::make_shared<SingleCallGuard>();
};

/// Runs long work in a separate thread. On ^C, raises KeyboardInterrupt immediately; the work continues in the
/// background. The work must therefore own all data that it reads.
template <typename Work>
auto run_interruptibly(std::string_view what, int num_threads, Device device, Work work) {
  using Result = decltype(work());
  check_process(what, num_threads, device);
  auto task = std::make_shared<std::packaged_task<Result()>>(std::move(work));
  std::future<Result> result = task->get_future();
  std::thread([task = std::move(task)] { (*task)(); }).detach();
  for (;;) {
    {
      const GilRelease no_gil;
      if (result.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready) break;
    }
    if (PyErr_CheckSignals() != 0) throw py::error_already_set();
  }
  return result.get();
}

/// Runs long work in a separate thread. On ^C, waits until the work returns, then raises KeyboardInterrupt. The work
/// must return early when interrupted() is true. It may call Python functions.
template <typename Work>
auto run_interruptible(std::string_view what, int num_threads, Device device, Work work) {
  check_process(what, num_threads, device);
  std::exception_ptr raised;
  auto result = std::async(std::launch::async, std::move(work));
  for (;;) {
    {
      const GilRelease no_gil;
      if (result.wait_for(std::chrono::milliseconds(20)) == std::future_status::ready) break;
    }
    if (!raised && PyErr_CheckSignals() != 0) {
      raised = std::make_exception_ptr(py::error_already_set());
      record_interrupt(SIGINT);
    }
  }
  if (raised) {
    clear_interrupt();
    std::rethrow_exception(raised);
  }
  return result.get();
}

}  // namespace pictura::python
