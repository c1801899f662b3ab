// Arrays between C++ and Python: `pictura.Array`, which lends memory of the library through DLPack and NumPy, and what
// callers hand in, which is looked at through DLPack and never copied.
#pragma once

#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include <pybind11/numpy.h>
#include <pybind11/pybind11.h>

#include "pictura/bindings/dlpack.h"
#include "pictura/common/array.h"
#include "pictura/common/device.h"
#include "pictura/common/error.h"

namespace pictura::python {

namespace py = pybind11;

/// Lengths or strides of any rank that Dims has. Throws Error for more.
Dims dims_of(const std::vector<int64_t>& values);

/// An array that its owner keeps alive: it outlives the simulator or renderer that wrote it.
struct LentArray {
  Array array;
  std::shared_ptr<const void> owner;
  Stream stream;         // that work on it is put on; null: CUDA's legacy default stream
  bool is_bool = false;  // u8 of 0 and 1
  std::string what;      // its name in messages
};

/// An array of a caller, at its own address. Holds what lends it.
class BorrowedArray {
 public:
  BorrowedArray() = default;
  BorrowedArray(BorrowedArray&& other) noexcept { *this = std::move(other); }
  BorrowedArray& operator=(BorrowedArray&& other) noexcept;
  BorrowedArray(const BorrowedArray&) = delete;
  ~BorrowedArray();

  const Array& array() const { return array_; }

 private:
  friend BorrowedArray borrow(const py::handle& object, std::string_view what, Stream stream);
  Array array_;
  py::object keep_;
  dlpack::DLManagedTensorVersioned* versioned_ = nullptr;
  dlpack::DLManagedTensor* older_ = nullptr;
};

/// Looks at an array of the caller: a LentArray or anything that speaks DLPack (NumPy, torch, JAX, CuPy). What a device
/// still writes to it comes before later work on `stream`. Throws Error naming `what` for other objects, element types
/// that the library has none of, and devices other than the host and CUDA's. The caller holds the GIL.
BorrowedArray borrow(const py::handle& object, std::string_view what, Stream stream);

/// A NumPy array of structs as the bytes that it is: [count, size] u8 on the host; anything else as borrow().
BorrowedArray borrow_structs(const py::handle& object, std::string_view what, size_t size, Stream stream);

/// A value of Python's. Throws UsageError saying what was expected where it is of another kind.
template <typename T>
T cast_checked(const py::handle& value, std::string_view what, std::string_view expected) {
  try {
    return py::cast<T>(value);
  } catch (const py::cast_error&) {
    fail_usage("{}: expected {}, got {}", what, expected, py::cast<std::string>(py::repr(value)));
  }
}

/// The name of an object's class, for messages.
std::string type_name_of(const py::handle& object);

void bind_arrays(py::module_& module);

}  // namespace pictura::python
