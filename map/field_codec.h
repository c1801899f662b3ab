// Serialization of structs that have a list of fields (map_fields.h). Fields are in declaration order; a 64-bit size
// precedes each string and vector.
#pragma once

#include <cstdint>
#include <cstring>
#include <string>
#include <string_view>
#include <tuple>
#include <type_traits>
#include <utility>
#include <vector>

#include "pictura/common/error.h"

namespace pictura {

/// Byte-order mark in the header of every cached file.
constexpr uint32_t kByteOrder = 0x01020304;

template <typename T>
using FieldsOf = decltype(fields_of(std::declval<T&>()));
template <typename T>
concept HasFields = requires(T& value) { fields_of(value); };
template <typename T>
concept IsNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
template <typename T>
constexpr bool kIsVector = false;
template <typename T>
constexpr bool kIsVector<std::vector<T>> = true;

/// Whether a T has the same bytes in memory and in the file, and every bit pattern is valid.
template <typename T>
constexpr bool is_plain() {
  if constexpr (HasFields<T>) {
    return []<typename... F>(std::type_identity<std::tuple<F&...>>) {
      return (is_plain<F>() && ...) && (sizeof(F) + ...) == sizeof(T);
    }(std::type_identity<FieldsOf<T>>());
  } else {
    return IsNumber<T>;
  }
}

/// Minimum size of a T in the file.
template <typename T>
constexpr uint64_t min_bytes() {
  if constexpr (HasFields<T>) {
    return []<typename... F>(std::type_identity<std::tuple<F&...>>) {
      return (min_bytes<F>() + ...);
    }(std::type_identity<FieldsOf<T>>());
  } else if constexpr (kIsVector<T> || std::is_same_v<T, std::string>) {
    return sizeof(uint64_t);
  } else {
    return sizeof(T);
  }
}

/// Appends T's layout: names of fields and sizes of numbers. Files contain it, so that they cannot be read as another
/// type.
template <typename T>
void append_layout(std::string* text_out) {
  if constexpr (HasFields<T>) {
    *text_out += '{';
    *text_out += field_names_of(T{});
    [&]<typename... F>(std::type_identity<std::tuple<F&...>>) {
      (append_layout<F>(text_out), ...);
    }(std::type_identity<FieldsOf<T>>());
    *text_out += '}';
  } else if constexpr (kIsVector<T>) {
    *text_out += '*';
    append_layout<typename T::value_type>(text_out);
  } else if constexpr (std::is_same_v<T, std::string>) {
    *text_out += 's';
  } else if constexpr (std::is_scalar_v<T>) {
    *text_out += std::is_floating_point_v<T> ? 'f' : 'i';
    *text_out += std::to_string(sizeof(T));
  } else {
    *text_out += std::to_string(sizeof(T) / sizeof(typename T::value_type));
    append_layout<typename T::value_type>(text_out);
  }
}

class FieldWriter {
 public:
  explicit FieldWriter(std::string* bytes) : bytes_(bytes) {}

  template <typename T>
  void put(const T& value) {
    if constexpr (HasFields<T>) {
      std::apply([&](const auto&... field) { (put(field), ...); }, fields_of(value));
    } else if constexpr (kIsVector<T> || std::is_same_v<T, std::string>) {
      put(uint64_t{value.size()});
      put_items(value.data(), value.size());
    } else if constexpr (std::is_scalar_v<T>) {
      put_bytes(&value, sizeof value);
    } else {
      put_items(value.data(), value.size());
    }
  }

 private:
  template <typename T>
  void put_items(const T* items, std::size_t count) {
    if constexpr (is_plain<T>()) {
      put_bytes(items, count * sizeof(T));
    } else {
      for (std::size_t i = 0; i < count; ++i) put(items[i]);
    }
  }
  void put_bytes(const void* data, std::size_t size) { bytes_->append(static_cast<const char*>(data), size); }

  std::string* bytes_;
};

class FieldReader {
 public:
  explicit FieldReader(std::string_view bytes) : rest_(bytes) {}

  template <typename T>
  void get(T* value_out) {
    if constexpr (HasFields<T>) {
      std::apply([&](auto&... field) { (get(&field), ...); }, fields_of(*value_out));
    } else if constexpr (kIsVector<T> || std::is_same_v<T, std::string>) {
      using Item = typename T::value_type;
      uint64_t count = 0;
      get(&count);
      PICTURA_CHECK(count <= rest_.size() / min_bytes<Item>(),
                    "damaged: a size of {} elements of at least {} bytes, but {} bytes remain", count,
                    min_bytes<Item>(), rest_.size());
      value_out->resize(count);
      get_items(value_out->data(), value_out->size());
    } else if constexpr (std::is_same_v<T, bool>) {
      uint8_t byte = 0;
      get(&byte);
      PICTURA_CHECK(byte <= 1, "damaged: expected 0 or 1 for a bool, got {}", byte);
      *value_out = byte != 0;
    } else if constexpr (std::is_enum_v<T>) {
      get_bytes(value_out, sizeof(T));
      PICTURA_CHECK(is_known(*value_out), "damaged: no enumerator has the number {}",
                    static_cast<std::underlying_type_t<T>>(*value_out));
    } else if constexpr (std::is_scalar_v<T>) {
      get_bytes(value_out, sizeof(T));
    } else {
      get_items(value_out->data(), value_out->size());
    }
  }

  void expect_end() const {
    PICTURA_CHECK(rest_.empty(), "damaged: {} bytes remain after the last element", rest_.size());
  }

 private:
  template <typename T>
  void get_items(T* items, std::size_t count) {
    if constexpr (is_plain<T>()) {
      get_bytes(items, count * sizeof(T));
    } else {
      for (std::size_t i = 0; i < count; ++i) get(&items[i]);
    }
  }
  void get_bytes(void* out, std::size_t size) {
    PICTURA_CHECK(size <= rest_.size(), "damaged: expected {} more bytes, got {}", size, rest_.size());
    if (size > 0) std::memcpy(out, rest_.data(), size);
    rest_.remove_prefix(size);
  }
  template <typename Enum>
  static bool is_known(Enum value) {
    return std::string_view(to_string(value)) != "unknown";
  }

  std::string_view rest_;
};

}  // namespace pictura
