// Extension module pictura._driving: saved policies and their evaluation on the CPU, without torch.
#include "pictura/bindings/driving.h"

PYBIND11_MODULE(_driving, module) {
  module.doc() = "Saved policies and their evaluation, on the CPU. Use them as names of `pictura`.";
  pictura::python::bind_driving(module);
}
