// Arrays between C++ and Python: `pictura.Array`, which lends library memory through DLPack and NumPy, and arrays of
// callers, which are accessed through DLPack and never copied.
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

/// Returns lengths or strides of any rank that Dims supports. Throws Error for higher ranks.
Dims dims_of(const std::vector<int64_t>& values);

/// Array that its owner keeps alive: it outlives the simulator or renderer that wrote it.
struct LentArray {
  Array array;
  std::shared_ptr<const void> owner;
  Stream stream;         // stream of the work on it; null: CUDA's legacy default stream
  bool is_bool = false;  // u8 with values 0 and 1
  std::string what;      // name in messages
};

/// Array of a caller, at its own address. Holds a reference to the lender.
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

/// Accesses an array of the caller: a LentArray or any object with DLPack (NumPy, torch, JAX, CuPy). Pending writes of
/// a device are ordered before later work on `stream`. Throws Error naming `what` for other objects, unsupported
/// element types, and devices other than the host and CUDA's. The caller must hold the GIL.
BorrowedArray borrow(const py::handle& object, std::string_view what, Stream stream);

/// Borrows a NumPy array of structs as bytes, [count, size] u8 on the host; anything else as borrow() does.
BorrowedArray borrow_structs(const py::handle& object, std::string_view what, size_t size, Stream stream);

/// Converts a Python value. Throws UsageError with the expected kind if the value is of another kind.
template <typename T>
T cast_checked(const py::handle& value, std::string_view what, std::string_view expected) {
  try {
    return py::cast<T>(value);
  } catch (const py::cast_error&) {
    fail_usage("{}: expected {}, got {}", what, expected, py::cast<std::string>(py::repr(value)));
  }
}

/// Name of an object's class, for messages.
std::string type_name_of(const py::handle& object);

void bind_arrays(py::module_& module);

}  // namespace pictura::python
