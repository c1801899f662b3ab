// Arrays at public interfaces. Kernels take spans instead (span.h).
#pragma once

#include <array>
#include <concepts>
#include <initializer_list>
#include <string>
#include <string_view>
#include <type_traits>

#include "pictura/common/device.h"
#include "pictura/common/error_types.h"
#include "pictura/common/span.h"

namespace pictura {

enum class ElementType : uint8_t { u8, u16, u32, i32, i64, f16, bf16, f32, f64 };
std::size_t bytes_of(ElementType type);
/// Element type's name, such as "u8" or "i32".
std::string_view name_of(ElementType type);
/// Device's name, such as "cpu" or "cuda:0".
std::string name_of(Device device);

/// Type that stores a T in an array: the underlying integer of an enumeration, else T without const.
template <typename T>
struct Stored {
  using Type = std::remove_const_t<T>;
};
template <typename T>
  requires std::is_enum_v<T>
struct Stored<T> {
  using Type = std::underlying_type_t<T>;
};
template <typename T>
using StoredAs = typename Stored<T>::Type;

/// ElementType of a C++ type. No C++ type maps to f16 or bf16.
template <typename T>
consteval ElementType element_type() {
  using U = StoredAs<T>;
  if constexpr (std::same_as<U, uint8_t>) return ElementType::u8;
  if constexpr (std::same_as<U, uint16_t>) return ElementType::u16;
  if constexpr (std::same_as<U, uint32_t>) return ElementType::u32;
  if constexpr (std::same_as<U, int32_t>) return ElementType::i32;
  if constexpr (std::same_as<U, int64_t>) return ElementType::i64;
  if constexpr (std::same_as<U, float>) return ElementType::f32;
  if constexpr (std::same_as<U, double>) return ElementType::f64;
}
template <typename T>
concept ArrayElement =
    std::same_as<StoredAs<T>, uint8_t> || std::same_as<StoredAs<T>, uint16_t> || std::same_as<StoredAs<T>, uint32_t> ||
    std::same_as<StoredAs<T>, int32_t> || std::same_as<StoredAs<T>, int64_t> || std::same_as<StoredAs<T>, float> ||
    std::same_as<StoredAs<T>, double>;

/// Lengths or strides of an array.
class Dims {
 public:
  static constexpr int kMaxRank = 5;
  Dims() = default;
  /// Throws Error for more than kMaxRank dimensions.
  Dims(std::initializer_list<int64_t> values);
  int rank() const { return rank_; }
  int64_t operator[](int dimension) const { return values_[dimension]; }
  int64_t& operator[](int dimension) { return values_[dimension]; }
  int64_t count() const;
  /// Strides, in elements, of a contiguous row-major array with these lengths.
  Dims contiguous_strides() const;
  bool operator==(const Dims& other) const;
  /// Text such as "[4096, 7]".
  std::string text() const;

 private:
  std::array<int64_t, kMaxRank> values_{};
  int rank_ = 0;
};

/// Non-owning view of an array. Element (i, j, ...) is at data + (i * strides[0] + j * strides[1] + ...) elements.
struct Array {
  void* data = nullptr;
  ElementType type = ElementType::u8;
  bool is_read_only = false;
  Dims shape, strides;  // strides in elements
  Device device;

  Array() = default;
  Array(void* its_data, ElementType its_type, Dims its_shape, Device its_device);
  /// Constructs a contiguous array.
  template <typename T>
    requires ArrayElement<std::remove_const_t<T>>
  Array(T* first, Dims its_shape, Device its_device)
      : Array(const_cast<std::remove_const_t<T>*>(first), element_type<T>(), its_shape, its_device) {
    is_read_only = std::is_const_v<T>;
  }
  /// Views a whole host container, with shape [size].
  template <typename Container>
    requires ArrayElement<std::remove_cvref_t<decltype(*std::declval<Container&>().data())>>
  Array(Container&& container)  // NOLINT: converts
      : Array(container.data(), {static_cast<int64_t>(container.size())}, Device{}) {}

  bool is_contiguous() const { return strides == shape.contiguous_strides(); }
  /// Returns the elements as a span. Throws Error if the element type, shape or device differs, or if the array has
  /// gaps. Also throws if T is not const but the array is read-only. The message begins with `what`.
  template <typename T>
  Span<T> checked(std::string_view what, const Dims& expected_shape, Device expected_device) const {
    check(what, element_type<T>(), !std::is_const_v<T>, expected_shape, expected_device);
    return {static_cast<T*>(data), static_cast<std::size_t>(shape.count())};
  }
  /// Text such as "f32 [4096, 7] on cuda:0".
  std::string text() const;

 private:
  void check(std::string_view what, ElementType expected_type, bool is_written, const Dims& expected_shape,
             Device expected_device) const;
};

struct NamedArray {
  std::string_view name;
  Array array;
};

}  // namespace pictura
