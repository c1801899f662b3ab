// Exchange of arrays between C++ and Python without copies.
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

/// Throws Error if the number of values exceeds the maximum rank of Dims.
Dims dims_of(const std::vector<int64_t>& values);

/// Library array that Python can access (pictura.Array). `owner` keeps its memory alive.
struct LentArray {
  Array array;
  std::shared_ptr<const void> owner;
  Stream stream;         // stream of work on the array; null: CUDA's legacy default stream
  bool is_bool = false;  // u8 elements are bools
  std::string what;      // name in messages
};

/// Python caller's array. Keeps the Python object that owns the memory.
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

/// Borrows a LentArray or any object that supports DLPack (NumPy, torch, JAX, CuPy). On a device, later work on
/// `stream` waits for pending writes. Throws Error naming `what` for other objects, unsupported element types, and
/// devices other than host and CUDA. The caller must hold the GIL.
BorrowedArray borrow(const py::handle& object, std::string_view what, Stream stream);

/// Also accepts NumPy arrays of structs of `size` bytes, as u8 [count, size] on the host.
BorrowedArray borrow_structs(const py::handle& object, std::string_view what, size_t size, Stream stream);

/// Throws UsageError with `what`, `expected` and the value if the conversion fails.
template <typename T>
T cast_checked(const py::handle& value, std::string_view what, std::string_view expected) {
  try {
    return py::cast<T>(value);
  } catch (const py::cast_error&) {
    fail_usage("{}: expected {}, got {}", what, expected, py::cast<std::string>(py::repr(value)));
  }
}

std::string type_name_of(const py::handle& object);

void bind_arrays(py::module_& module);

}  // namespace pictura::python
