// Reader of protobuf's wire format, without a schema.
#pragma once

#include <bit>
#include <cstdint>
#include <cstring>
#include <string_view>
#include <utility>

#include "pictura/map/scenario/field_error.h"

namespace pictura::womd {

enum class WireType : uint8_t { varint = 0, fixed64 = 1, bytes = 2, fixed32 = 5 };

/// Reads the fields of a message in sequence, and never beyond it. All members throw FieldError if the bytes are not a
/// message. Faults are a length or number beyond the end, a varint of more than 64 bits, wire types 3, 4, 6 and 7, and
/// field number 0.
class WireReader {
 public:
  explicit WireReader(std::string_view message) : rest_(message) {}

  /// Returns false at the end of the message.
  bool next() {
    if (rest_.empty()) return false;
    take_tag();
    switch (type_) {
      case WireType::varint: number_ = take_varint(); break;
      case WireType::fixed64: number_ = take_number<uint64_t>(); break;
      case WireType::fixed32: number_ = take_number<uint32_t>(); break;
      case WireType::bytes: {
        const uint64_t length = take_varint();
        if (length > rest_.size()) {
          fail_field("", "field {}: expected at most the {} remaining bytes of its message, got a length of {}", field_,
                     rest_.size(), length);
        }
        bytes_ = rest_.substr(0, static_cast<std::size_t>(length));
        rest_.remove_prefix(bytes_.size());
      }
    }
    return true;
  }

  /// Reads only the tag of the next field, whose value may be beyond this reader's bytes. Returns the sizes of the tag
  /// and of the value, in bytes. The tag's size includes a length prefix or a varint's value; the value's size is 0 for
  /// a varint.
  std::pair<std::size_t, uint64_t> next_extent() {
    const std::size_t before = rest_.size();
    take_tag();
    if (type_ == WireType::varint) return take_varint(), std::pair(before - rest_.size(), uint64_t{0});
    const uint64_t length = type_ == WireType::bytes ? take_varint() : type_ == WireType::fixed64 ? 8 : 4;
    return {before - rest_.size(), length};
  }

  uint32_t field() const { return field_; }
  WireType type() const { return type_; }

  // Values of the field. Throw FieldError if the field has another wire type.
  std::string_view bytes() const { return expect(WireType::bytes), bytes_; }
  double number64() const { return expect(WireType::fixed64), std::bit_cast<double>(number_); }
  float number32() const { return expect(WireType::fixed32), std::bit_cast<float>(static_cast<uint32_t>(number_)); }
  int64_t integer() const { return expect(WireType::varint), static_cast<int64_t>(number_); }
  /// Returns the low 32 bits, as protobuf's own readers do.
  int32_t integer32() const { return static_cast<int32_t>(integer()); }
  bool boolean() const { return integer() != 0; }

  /// Calls visit(value) for each value of a repeated field, packed or not.
  template <typename Visit>
  void integers(Visit&& visit) const {
    if (type_ == WireType::varint) return visit(integer());
    WireReader packed(bytes());
    while (!packed.rest_.empty()) visit(static_cast<int64_t>(packed.take_varint()));
  }
  template <typename Visit>
  void numbers64(Visit&& visit) const {
    if (type_ == WireType::fixed64) return visit(number64());
    WireReader packed(bytes());
    while (!packed.rest_.empty()) visit(std::bit_cast<double>(packed.take_number<uint64_t>()));
  }
  template <typename Visit>
  void numbers32(Visit&& visit) const {
    if (type_ == WireType::fixed32) return visit(number32());
    WireReader packed(bytes());
    while (!packed.rest_.empty()) visit(std::bit_cast<float>(packed.take_number<uint32_t>()));
  }

 private:
  void expect(WireType type) const {
    if (type_ != type) {
      fail_field("", "field {}: expected wire type {}, got {}", field_, static_cast<int>(type),
                 static_cast<int>(type_));
    }
  }

  void take_tag() {
    const uint64_t tag = take_varint();
    if (tag >> 32 != 0 || tag >> 3 == 0) fail_field("", "expected a field's tag, got {:#x}", tag);
    field_ = static_cast<uint32_t>(tag >> 3);
    const auto type = static_cast<int>(tag & 7);
    if (type != 0 && type != 1 && type != 2 && type != 5) {
      fail_field("", "field {}: expected wire type 0, 1, 2 or 5, got {}", field_, type);
    }
    type_ = static_cast<WireType>(type);
  }

  uint64_t take_varint() {
    uint64_t value = 0;
    for (int shift = 0; shift < 70; shift += 7) {
      if (rest_.empty()) fail_field("", "expected a varint, got the end of the message");
      const auto byte = static_cast<uint8_t>(rest_.front());
      rest_.remove_prefix(1);
      if (shift == 63 && byte > 1) break;
      value |= static_cast<uint64_t>(byte & 0x7F) << shift;
      if (byte < 0x80) return value;
    }
    fail_field("", "expected a varint of at most 64 bits, got a longer varint");
  }

  template <typename T>
  T take_number() {
    static_assert(std::endian::native == std::endian::little, "the wire format is little-endian");
    T value;
    if (rest_.size() < sizeof value) {
      fail_field("", "expected {} bytes of a number, got the {} remaining bytes of the message", sizeof value,
                 rest_.size());
    }
    std::memcpy(&value, rest_.data(), sizeof value);
    rest_.remove_prefix(sizeof value);
    return value;
  }

  std::string_view rest_, bytes_;
  uint64_t number_ = 0;
  uint32_t field_ = 0;
  WireType type_ = WireType::varint;
};

}  // namespace pictura::womd
