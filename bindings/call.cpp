#include "pictura/bindings/call.h"

#include <algorithm>

#include <unistd.h>

namespace pictura::python {

namespace {
// Id of the process that first used threads or CUDA; 0: none yet. A child of fork() inherits its parent's ids.
struct Processes {
  std::atomic<pid_t> of_threads{0}, of_cuda{0};
};

// Returns the ids, which all extension modules of the package share. The caller must hold the GIL.
Processes& processes() {
  static Processes& shared = py::get_or_create_shared_data<Processes>("pictura: processes");
  return shared;
}

bool is_forked(std::atomic<pid_t>* process) {
  pid_t none = 0;
  return !process->compare_exchange_strong(none, getpid()) && none != getpid();
}
}  // namespace

void check_process(std::string_view what, int num_threads, Device device) {
  PICTURA_CHECK(
      device.is_host() || !is_forked(&processes().of_cuda),
      "{}: this process was forked after CUDA was used, which does not survive a fork: use the start method spawn",
      what);
  PICTURA_CHECK(num_threads == 1 || !is_forked(&processes().of_threads),
                "{}: this process was forked after pictura had used several threads, which do not survive a fork: pass "
                "num_threads=1, or use the start method spawn",
                what);
}

namespace {
// Calls f for each C++ class of a module, with pybind11's type information.
template <typename F>
void for_each_class(const py::module_& module, F&& f) {
  for (const auto& [name, value] : py::dict(module.attr("__dict__").attr("copy")())) {
    if (!PyType_Check(value.ptr())) continue;
    auto* const info = py::detail::get_type_info(reinterpret_cast<PyTypeObject*>(value.ptr()));
    if (info) f(py::reinterpret_borrow<py::object>(value), info);
  }
}
}  // namespace

void reject_uninitialized_objects(const py::module_& module) {
  for_each_class(module, [](const py::object&, py::detail::type_info* info) {
    info->operator_new = [](size_t) -> void* {
      fail("expected an object created by calling its class, got an object created only by __new__");
    };
  });
}

void pickle_by_new_protocols(const py::module_& module) {
  for_each_class(module, [](const py::object& its_class, py::detail::type_info*) {
    const auto reduce = [](const py::object& self, int protocol) {
      return py::module_::import("builtins").attr("object").attr("__reduce_ex__")(self, std::max(protocol, 2));
    };
    its_class.attr("__reduce_ex__") = py::cpp_function(reduce, py::name("__reduce_ex__"), py::is_method(its_class));
  });
}

}  // namespace pictura::python
