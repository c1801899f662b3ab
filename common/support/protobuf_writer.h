// Writer of the wire format of Protocol Buffers. A field is a varint (field << 3 | wire type), followed by the value.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>

namespace pictura {

static_assert(std::endian::native == std::endian::little, "the wire format is little-endian");

template <typename T>
std::string_view bytes_of(const T& number) {
  return {reinterpret_cast<const char*>(&number), sizeof number};
}

inline void append_varint(uint64_t value, std::string* out) {
  for (; value >= 0x80; value >>= 7) out->push_back(static_cast<char>(value | 0x80));
  out->push_back(static_cast<char>(value));
}

/// `field` is a field number or an enumerator.
template <typename Field>
void append_integer(Field field, uint64_t value, std::string* out) {
  append_varint(static_cast<uint64_t>(field) << 3, out);
  append_varint(value, out);
}

template <typename Field>
void append_double(Field field, double value, std::string* out) {
  append_varint(static_cast<uint64_t>(field) << 3 | 1, out);
  out->append(bytes_of(value));
}

template <typename Field>
void append_float(Field field, float value, std::string* out) {
  append_varint(static_cast<uint64_t>(field) << 3 | 5, out);
  out->append(bytes_of(value));
}

/// Appends a text, packed numbers, or a nested message.
template <typename Field>
void append_bytes(Field field, std::string_view bytes, std::string* out) {
  append_varint(static_cast<uint64_t>(field) << 3 | 2, out);
  append_varint(bytes.size(), out);
  out->append(bytes);
}

}  // namespace pictura
