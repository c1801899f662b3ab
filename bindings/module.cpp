// Extension module pictura._pictura: the parts of the library that need no torch.
#include <pybind11/pybind11.h>

#include "pictura/bindings/call.h"
#include "pictura/bindings/objects.h"
#include "pictura/common/error.h"
#include "pictura/common/support/hash.h"
#include "pictura/configuration/removed_keys.h"
#include "pictura/version.h"

PYBIND11_MODULE(_pictura, module) {
  namespace py = pybind11;
  module.doc() = "The pictura library: maps, scenes, renderers and simulators. Import these names from `pictura`.";
  // The exceptions are never destroyed, because static objects outlive the interpreter.
  static const py::handle error = py::exception<pictura::Error>(module, "Error", PyExc_RuntimeError).release();
  static const py::handle usage_error =
      py::exception<pictura::UsageError>(module, "UsageError", py::make_tuple(error, py::handle(PyExc_ValueError)))
          .release();
  error.attr("__doc__") = "A call failed. The message names the expected and the actual value.";
  usage_error.attr("__doc__") =
      "Invalid usage: an argument does not exist, has an invalid value, or conflicts with other arguments.";
  py::register_exception_translator([](std::exception_ptr thrown) {
    try {
      if (thrown) std::rethrow_exception(thrown);
    } catch (const pictura::Interrupted&) {
      PyErr_SetNone(PyExc_KeyboardInterrupt);
    } catch (const pictura::UsageError& e) {
      py::set_error(usage_error, e.what());
    } catch (const pictura::Error& e) {
      py::set_error(error, e.what());
    }
  });
  module.attr("__version__") = PICTURA_VERSION;
#ifdef PICTURA_HAS_CUDA
  module.attr("HAS_CUDA") = true;
#else
  module.attr("HAS_CUDA") = false;
#endif
  module.def(
      "_hash64", [](const py::bytes& bytes) { return pictura::hash_of(std::string_view(bytes)); }, py::arg("data"),
      "Returns the FNV-1a hash that ends files of the library.");
  module.def(
      "_removed_keys",
      [] {
        py::list keys;
        for (const auto& [name, value, reason] : pictura::kRemovedKeys)
          keys.append(py::make_tuple(name, value, reason));
        return keys;
      },
      "Returns removed keys of configurations, a tuple each: name, the only valid value, as JSON, and the reason.");
  pictura::python::bind_arrays(module);
  pictura::python::bind_maps(module);
  pictura::python::bind_scenarios(module);
  pictura::python::bind_rendering(module);
  pictura::python::bind_simulator(module);
  pictura::python::bind_replays(module);
  pictura::python::bind_realism(module);
  pictura::python::reject_uninitialized_objects(module);
  pictura::python::pickle_by_new_protocols(module);
}
