#include "pictura/bindings/arrays.h"

#include <algorithm>
#include <cstring>
#include <optional>
#include <utility>

#include <fmt/format.h>
#include <pybind11/stl.h>

#include "pictura/common/error.h"
#ifdef PICTURA_HAS_CUDA
#include "pictura/common/cuda/stream_order.h"
#endif

namespace pictura::python {

using namespace dlpack;

namespace {

constexpr const char* kVersionedName = "dltensor_versioned";
constexpr const char* kUsedVersionedName = "used_dltensor_versioned";
constexpr const char* kName = "dltensor";
constexpr const char* kUsedName = "used_dltensor";

DLDataType dl_type(const LentArray& lent) {
  if (lent.is_bool) return {kBool, 8, 1};
  const auto bits = static_cast<uint8_t>(8 * bytes_of(lent.array.type));
  switch (lent.array.type) {
    case ElementType::u8:
    case ElementType::u16:
    case ElementType::u32: return {kUInt, bits, 1};
    case ElementType::i32:
    case ElementType::i64: return {kInt, bits, 1};
    case ElementType::bf16: return {kBfloat, bits, 1};
    case ElementType::f16:
    case ElementType::f32:
    case ElementType::f64: return {kFloat, bits, 1};
  }
  fail("array: no element type {}", static_cast<int>(lent.array.type));
}

std::optional<ElementType> element_type_of(DLDataType type) {
  if (type.lanes != 1) return {};
  switch (type.code) {
    case kBool:
      if (type.bits == 8) return ElementType::u8;
      break;
    case kUInt:
      if (type.bits == 8) return ElementType::u8;
      if (type.bits == 16) return ElementType::u16;
      if (type.bits == 32) return ElementType::u32;
      break;
    case kInt:
      if (type.bits == 32) return ElementType::i32;
      if (type.bits == 64) return ElementType::i64;
      break;
    case kFloat:
      if (type.bits == 16) return ElementType::f16;
      if (type.bits == 32) return ElementType::f32;
      if (type.bits == 64) return ElementType::f64;
      break;
    case kBfloat:
      if (type.bits == 16) return ElementType::bf16;
      break;
    default: break;
  }
  return {};
}

/// Returns NumPy's name of an element type. NumPy has no bf16.
std::string numpy_name(const LentArray& lent) {
  if (lent.is_bool) return "bool";
  switch (lent.array.type) {
    case ElementType::u8: return "uint8";
    case ElementType::u16: return "uint16";
    case ElementType::u32: return "uint32";
    case ElementType::i32: return "int32";
    case ElementType::i64: return "int64";
    case ElementType::f16: return "float16";
    case ElementType::bf16: return "bfloat16";
    case ElementType::f32: return "float32";
    case ElementType::f64: return "float64";
  }
  return "";
}

/// Returns the NumPy type. Common types are selected without a slow look-up by name.
py::dtype numpy_type(const LentArray& lent) {
  if (lent.is_bool) return py::dtype::of<bool>();
  switch (lent.array.type) {
    case ElementType::u8: return py::dtype::of<uint8_t>();
    case ElementType::i32: return py::dtype::of<int32_t>();
    case ElementType::f32: return py::dtype::of<float>();
    default: return py::dtype(numpy_name(lent));
  }
}

std::vector<int64_t> values_of(const Dims& dims) {
  std::vector<int64_t> values;
  for (int i = 0; i < dims.rank(); ++i) values.push_back(dims[i]);
  return values;
}

/// DLPack tensor, in the versioned or older form, with the memory of a LentArray.
template <typename Managed>
struct Lending {
  Managed managed;
  std::vector<int64_t> shape, strides;
  std::shared_ptr<const void> owner;
  std::vector<uint8_t> copy;  // the tensor's memory if a copy was requested

  static Managed* make(const LentArray& lent, bool copied) {
    auto lending = std::make_unique<Lending>();
    lending->shape = values_of(lent.array.shape);
    lending->strides = values_of(lent.array.strides);
    lending->owner = lent.owner;
    DLTensor& tensor = lending->managed.dl_tensor;
    tensor.data = lent.array.data;
    if (copied) {
      lending->copy = contiguous_bytes(lent.array);
      lending->strides = values_of(lent.array.shape.contiguous_strides());
      tensor.data = lending->copy.data();
    }
    tensor.device = {lent.array.device.is_host() ? kCpu : kCuda, lent.array.device.index};
    tensor.ndim = lent.array.shape.rank();
    tensor.dtype = dl_type(lent);
    tensor.shape = lending->shape.data();
    tensor.strides = lending->strides.data();
    lending->managed.manager_ctx = lending.get();
    // The owner is a C++ object, so it can be released without the GIL.
    lending->managed.deleter = [](Managed* self) { delete static_cast<Lending*>(self->manager_ctx); };
    return &lending.release()->managed;
  }

  static std::vector<uint8_t> contiguous_bytes(const Array& array) {
    const size_t size = bytes_of(array.type);
    std::vector<uint8_t> bytes(static_cast<size_t>(array.shape.count()) * size);
    const Dims& shape = array.shape;
    for (int64_t i = 0; i < shape.count(); ++i) {
      int64_t rest = i, at = 0;
      for (int d = shape.rank() - 1; d >= 0; --d) {
        at += rest % shape[d] * array.strides[d];
        rest /= shape[d];
      }
      std::memcpy(bytes.data() + static_cast<size_t>(i) * size,
                  static_cast<const uint8_t*>(array.data) + at * static_cast<int64_t>(size), size);
    }
    return bytes;
  }
};

/// Frees the tensor of a capsule if no consumer has taken it.
void drop_versioned(PyObject* capsule) {
  if (!PyCapsule_IsValid(capsule, kVersionedName)) return;
  auto* tensor = static_cast<DLManagedTensorVersioned*>(PyCapsule_GetPointer(capsule, kVersionedName));
  tensor->deleter(tensor);
}
void drop_older(PyObject* capsule) {
  if (!PyCapsule_IsValid(capsule, kName)) return;
  auto* tensor = static_cast<DLManagedTensor*>(PyCapsule_GetPointer(capsule, kName));
  tensor->deleter(tensor);
}

[[noreturn]] void throw_error(const std::string& message) {
  PyErr_SetString(PyExc_BufferError, message.c_str());
  throw py::error_already_set();
}

constexpr const char* kStream = "a stream as int, or None";

/// Makes the consumer's stream wait for the library's work on the array's stream. `stream` is a stream number as DLPack
/// defines it.
void order_before(const LentArray& lent, const py::object& stream) {
  if (lent.array.device.is_host()) {
    if (!stream.is_none() && cast_checked<int64_t>(stream, lent.what, kStream) != -1) {
      throw_error(fmt::format("{}: expected stream=None for an array on cpu", lent.what));
    }
    return;
  }
#ifdef PICTURA_HAS_CUDA
  const int64_t number = stream.is_none() ? 1 : cast_checked<int64_t>(stream, lent.what, kStream);
  if (number == -1) return;
  if (number == 0 || number < -1) {
    throw_error(fmt::format("{}: expected a stream of None, -1, 1, 2 or a cudaStream_t, got {}", lent.what, number));
  }
  order_streams(lent.array.device, lent.stream, stream_of_number(number));
#endif
}

py::object dlpack_of(const LentArray& lent, const py::object& stream, const py::object& max_version,
                     const py::object& dl_device, const py::object& copy) {
  if (!dl_device.is_none()) {
    const auto wanted =
        cast_checked<std::pair<int32_t, int32_t>>(dl_device, lent.what, "dl_device (type, index), or None");
    const std::pair<int32_t, int32_t> own{lent.array.device.is_host() ? kCpu : kCuda, lent.array.device.index};
    if (wanted != own) {
      throw_error(fmt::format("{}: is on {}; expected dl_device ({}, {}), got ({}, {})", lent.what,
                              name_of(lent.array.device), own.first, own.second, wanted.first, wanted.second));
    }
  }
  const bool copies = !copy.is_none() && cast_checked<bool>(copy, lent.what, "copy=True, False or None");
  if (copies && !lent.array.device.is_host()) {
    throw_error(fmt::format("{}: is on {}, where pictura cannot copy it: pass copy=False or None, then copy the result",
                            lent.what, name_of(lent.array.device)));
  }
  const bool is_versioned = !max_version.is_none() && cast_checked<std::pair<uint32_t, uint32_t>>(
                                                          max_version, lent.what, "max_version (major, minor), or None")
                                                              .first >= 1;
  const bool is_read_only = lent.array.is_read_only && !copies;
  if (is_read_only && !is_versioned) {
    throw_error(fmt::format(
        "{}: is read-only, which DLPack before 1.0 cannot express: pass max_version=(1, 0) or copy=True", lent.what));
  }
  order_before(lent, stream);
  if (is_versioned) {
    auto* tensor = Lending<DLManagedTensorVersioned>::make(lent, copies);
    tensor->version = {1, 0};
    tensor->flags = (is_read_only ? kReadOnly : 0) | (copies ? kIsCopied : 0);
    PyObject* capsule = PyCapsule_New(tensor, kVersionedName, drop_versioned);
    if (!capsule) {
      tensor->deleter(tensor);
      throw py::error_already_set();
    }
    return py::reinterpret_steal<py::object>(capsule);
  }
  auto* tensor = Lending<DLManagedTensor>::make(lent, copies);
  PyObject* capsule = PyCapsule_New(tensor, kName, drop_older);
  if (!capsule) {
    tensor->deleter(tensor);
    throw py::error_already_set();
  }
  return py::reinterpret_steal<py::object>(capsule);
}

py::array numpy_of(const py::object& self) {
  const auto& lent = py::cast<const LentArray&>(self);
  if (!lent.array.device.is_host() || lent.array.type == ElementType::bf16) {
    PyErr_SetString(PyExc_TypeError,
                    fmt::format("{}: expected an array on cpu with a NumPy type, got {}; use torch.from_dlpack",
                                lent.what, lent.array.text())
                        .c_str());
    throw py::error_already_set();
  }
  std::vector<py::ssize_t> shape, strides;
  for (int i = 0; i < lent.array.shape.rank(); ++i) {
    shape.push_back(lent.array.shape[i]);
    strides.push_back(lent.array.strides[i] * static_cast<py::ssize_t>(bytes_of(lent.array.type)));
  }
  py::array view(numpy_type(lent), shape, strides, lent.array.data, self);
  // Equivalent to setflags(write=False), but much faster.
  if (lent.array.is_read_only) {
    py::detail::array_proxy(view.ptr())->flags &= ~py::detail::npy_api::NPY_ARRAY_WRITEABLE_;
  }
  return view;
}

void check_tensor(const DLTensor& tensor, std::string_view what, Array* array_out) {
  PICTURA_CHECK(tensor.ndim >= 0 && tensor.ndim <= Dims::kMaxRank, "{}: expected at most {} dimensions, got {}", what,
                Dims::kMaxRank, tensor.ndim);
  const std::optional<ElementType> type = element_type_of(tensor.dtype);
  PICTURA_CHECK(type,
                "{}: expected elements of u8, u16, u32, i32, i64, f16, bf16, f32, f64 or bool, got DLPack's code "
                "{} with {} bits and {} lanes",
                what, tensor.dtype.code, tensor.dtype.bits, tensor.dtype.lanes);
  Device device;
  if (tensor.device.device_type == kCuda || tensor.device.device_type == kCudaManaged) {
    device = {MemorySpace::cuda, tensor.device.device_id};
  } else {
    PICTURA_CHECK(tensor.device.device_type == kCpu || tensor.device.device_type == kCudaHost,
                  "{}: expected an array on cpu or cuda, got one on DLPack's device type {}", what,
                  tensor.device.device_type);
  }
  const std::vector<int64_t> lengths(tensor.shape, tensor.shape + tensor.ndim);
  auto num_bytes = static_cast<int64_t>(bytes_of(*type));
  for (const int64_t length : lengths) {
    PICTURA_CHECK(length >= 0 && !__builtin_mul_overflow(num_bytes, std::max<int64_t>(length, 1), &num_bytes),
                  "{}: expected lengths of 0 or more that memory can have, got [{}]", what, fmt::join(lengths, ", "));
  }
  const Dims shape = dims_of(lengths);
  uint8_t* const first = static_cast<uint8_t*>(tensor.data) + tensor.byte_offset;
  PICTURA_CHECK(shape.count() == 0 || reinterpret_cast<uintptr_t>(first) % bytes_of(*type) == 0,
                "{}: expected memory that is aligned for {}", what, name_of(*type));
  *array_out = Array(first, *type, shape, device);
  if (!tensor.strides) return;
  for (int i = 0; i < tensor.ndim && shape.count() > 0; ++i) {
    // The stride of a dimension of length 1 has no meaning.
    if (shape[i] != 1) array_out->strides[i] = tensor.strides[i];
  }
}

/// Returns the DLPack capsule of an object. If the object is on a CUDA device, `stream` waits for pending work on it.
py::object capsule_of(const py::handle& object, [[maybe_unused]] std::string_view what,
                      [[maybe_unused]] Stream stream) {
  const auto device = py::cast<std::pair<int32_t, int32_t>>(py::tuple(object.attr("__dlpack_device__")()));
  py::dict arguments;
  if (device.first == kCuda || device.first == kCudaManaged) {
#ifdef PICTURA_HAS_CUDA
    arguments["stream"] = number_of_stream(stream);
#else
    fail("{}: expected an array on cpu, got one on cuda:{}: this build has no CUDA", what, device.second);
#endif
  }
  const py::object lend = object.attr("__dlpack__");
  arguments["max_version"] = py::make_tuple(1, 0);
  try {
    return lend(**arguments);
  } catch (const py::error_already_set& error) {
    if (!error.matches(PyExc_TypeError)) throw;
  }
  // The object has an interface older than DLPack 1.0.
  PyDict_DelItemString(arguments.ptr(), "max_version");
  return lend(**arguments);
}

}  // namespace

Dims dims_of(const std::vector<int64_t>& v) {
  switch (v.size()) {
    case 0: return {};
    case 1: return {v[0]};
    case 2: return {v[0], v[1]};
    case 3: return {v[0], v[1], v[2]};
    case 4: return {v[0], v[1], v[2], v[3]};
    case 5: return {v[0], v[1], v[2], v[3], v[4]};
    default: fail("array: expected at most {} dimensions, got {}", Dims::kMaxRank, v.size());
  }
}

std::string type_name_of(const py::handle& object) {
  return py::cast<std::string>(py::type::handle_of(object).attr("__name__"));
}

BorrowedArray& BorrowedArray::operator=(BorrowedArray&& other) noexcept {
  std::swap(array_, other.array_);
  std::swap(keep_, other.keep_);
  std::swap(versioned_, other.versioned_);
  std::swap(older_, other.older_);
  return *this;
}

BorrowedArray::~BorrowedArray() {
  if (!versioned_ && !older_ && !keep_) return;
  // The deleters may release Python objects.
  const py::gil_scoped_acquire gil;
  if (versioned_ && versioned_->deleter) versioned_->deleter(versioned_);
  if (older_ && older_->deleter) older_->deleter(older_);
  keep_ = {};
}

BorrowedArray borrow(const py::handle& object, std::string_view what, Stream stream) {
  BorrowedArray borrowed;
  if (py::isinstance<LentArray>(object)) {
    const auto& lent = py::cast<const LentArray&>(object);
    borrowed.array_ = lent.array;
    borrowed.keep_ = py::reinterpret_borrow<py::object>(object);
#ifdef PICTURA_HAS_CUDA
    if (!lent.array.device.is_host()) order_streams(lent.array.device, lent.stream, stream);
#endif
    return borrowed;
  }
  PICTURA_CHECK(py::hasattr(object, "__dlpack__") && py::hasattr(object, "__dlpack_device__"),
                "{}: expected an array with DLPack (NumPy, torch, ...), got {}", what, type_name_of(object));
  const py::object capsule = capsule_of(object, what, stream);
  if (PyCapsule_IsValid(capsule.ptr(), kVersionedName)) {
    auto* tensor = static_cast<DLManagedTensorVersioned*>(PyCapsule_GetPointer(capsule.ptr(), kVersionedName));
    PICTURA_CHECK(tensor->version.major == 1, "{}: expected DLPack 1, got {}.{}", what, tensor->version.major,
                  tensor->version.minor);
    PyCapsule_SetName(capsule.ptr(), kUsedVersionedName);
    borrowed.versioned_ = tensor;
    check_tensor(tensor->dl_tensor, what, &borrowed.array_);
    borrowed.array_.is_read_only = (tensor->flags & kReadOnly) != 0;
    return borrowed;
  }
  PICTURA_CHECK(PyCapsule_IsValid(capsule.ptr(), kName), "{}: expected a DLPack capsule from __dlpack__", what);
  auto* tensor = static_cast<DLManagedTensor*>(PyCapsule_GetPointer(capsule.ptr(), kName));
  PyCapsule_SetName(capsule.ptr(), kUsedName);
  borrowed.older_ = tensor;
  check_tensor(tensor->dl_tensor, what, &borrowed.array_);
  return borrowed;
}

BorrowedArray borrow_structs(const py::handle& object, std::string_view what, size_t size, Stream stream) {
  if (!py::isinstance<py::array>(object)) return borrow(object, what, stream);
  const auto array = py::reinterpret_borrow<py::array>(object);
  if (array.dtype().kind() != 'V') return borrow(object, what, stream);
  PICTURA_CHECK(array.ndim() == 1 && static_cast<size_t>(array.itemsize()) == size &&
                    (array.size() <= 1 || static_cast<size_t>(array.strides(0)) == size),
                "{}: expected structs of {} bytes, contiguous [n], got {} dimensions of {} bytes", what, size,
                array.ndim(), array.itemsize());
  return borrow(array.attr("view")("uint8").attr("reshape")(array.size(), size), what, stream);
}

void bind_arrays(py::module_& module) {
  py::class_<LentArray>(module, "Array", R"(
Array in the library's memory, lent without a copy.

On the CPU, `numpy.asarray(array)` returns a NumPy view. On any device, DLPack gives access: `torch.from_dlpack`,
`numpy.from_dlpack`, JAX and CuPy. The memory remains allocated while any reference to it exists, even after its
simulator or renderer is deleted. Later calls of the simulator or renderer change the contents.

Examples:
    >>> simulator = pictura.Simulator([pictura.Map.load('procedural:3')], [(0, 4)])
    >>> ego = simulator.observations['ego']
    >>> ego.shape, ego.dtype, ego.device
    ((4, 9), 'float32', 'cpu')
    >>> ego.numpy().base is not None            # a view, not a copy
    True)")
      .def_property_readonly(
          "shape", [](const LentArray& lent) { return py::tuple(py::cast(values_of(lent.array.shape))); },
          py::doc("Lengths of the dimensions, a tuple of int."))
      .def_property_readonly(
          "strides", [](const LentArray& lent) { return py::tuple(py::cast(values_of(lent.array.strides))); },
          py::doc("Strides in elements, a tuple of int."))
      .def_property_readonly("dtype", numpy_name, py::doc("NumPy's name of the element type, for instance 'float32'."))
      .def_property_readonly(
          "device", [](const LentArray& lent) { return name_of(lent.array.device); }, py::doc("'cpu' or 'cuda:0'."))
      .def_property_readonly(
          "read_only", [](const LentArray& lent) { return lent.array.is_read_only; },
          py::doc("Whether the array is read-only."))
      .def("numpy", numpy_of, "Returns a NumPy view. Raises TypeError if the array is not on the CPU.")
      .def(
          "torch", [](const py::object& self) { return py::module_::import("torch").attr("from_dlpack")(self); },
          "Returns a torch tensor that shares the memory. Imports torch.")
      .def(
          "__array__",
          [](const py::object& self, const py::object& dtype, const py::object& copy) -> py::object {
            const py::object view = numpy_of(self);
            const bool same = dtype.is_none() || py::dtype::from_args(dtype).equal(view.attr("dtype"));
            if (same && (copy.is_none() || !py::cast<bool>(copy))) return view;
            if (!copy.is_none() && !py::cast<bool>(copy)) {
              PyErr_SetString(PyExc_ValueError, "array: another element type needs a copy, and copy=False was given");
              throw py::error_already_set();
            }
            return view.attr("astype")(dtype.is_none() ? view.attr("dtype") : dtype);
          },
          py::arg("dtype") = py::none(), py::arg("copy") = py::none())
      .def("__dlpack__", dlpack_of, py::kw_only(), py::arg("stream") = py::none(), py::arg("max_version") = py::none(),
           py::arg("dl_device") = py::none(), py::arg("copy") = py::none(),
           "Returns a DLPack capsule, versioned if max_version is (1, 0) or later. Raises BufferError if the array "
           "cannot be exported.")
      .def(
          "__dlpack_device__",
          [](const LentArray& lent) {
            return std::pair<int, int>(lent.array.device.is_host() ? kCpu : kCuda, lent.array.device.index);
          },
          "DLPack's (device type, index): (1, 0) on the CPU, (2, i) on CUDA device i.")
      .def("__len__",
           [](const LentArray& lent) {
             PICTURA_CHECK(lent.array.shape.rank() > 0, "{}: an array without dimensions has no length", lent.what);
             return lent.array.shape[0];
           })
      .def(
          "__getitem__", [](const py::object& self, const py::object& at) -> py::object { return numpy_of(self)[at]; },
          "Indexes the NumPy view.")
      .def("__repr__",
           [](const LentArray& lent) { return fmt::format("<pictura.Array {}: {}>", lent.what, lent.array.text()); });
}

}  // namespace pictura::python
