#include "pictura/common/array.h"

#include <algorithm>

#include <fmt/ranges.h>

#include "pictura/common/error.h"

namespace pictura {

std::size_t bytes_of(ElementType type) {
  switch (type) {
    case ElementType::u8: return 1;
    case ElementType::u16:
    case ElementType::f16:
    case ElementType::bf16: return 2;
    case ElementType::u32:
    case ElementType::i32:
    case ElementType::f32: return 4;
    case ElementType::i64:
    case ElementType::f64: return 8;
  }
  fail("array: no element type {}", static_cast<int>(type));
}

std::string_view name_of(ElementType type) {
  constexpr std::string_view kNames[] = {"u8", "u16", "u32", "i32", "i64", "f16", "bf16", "f32", "f64"};
  return kNames[static_cast<size_t>(type)];
}

std::string name_of(Device device) { return device.is_host() ? "cpu" : fmt::format("cuda:{}", device.index); }

Dims::Dims(std::initializer_list<int64_t> values) : rank_(static_cast<int>(values.size())) {
  PICTURA_CHECK(rank_ <= kMaxRank, "array: expected at most {} dimensions, got {}", kMaxRank, rank_);
  std::copy(values.begin(), values.end(), values_.begin());
}

int64_t Dims::count() const {
  int64_t count = 1;
  for (int i = 0; i < rank_; ++i) count *= (*this)[i];
  return count;
}

Dims Dims::contiguous_strides() const {
  Dims strides = *this;
  int64_t stride = 1;
  for (int i = rank_ - 1; i >= 0; --i) {
    strides[i] = stride;
    stride *= (*this)[i];
  }
  return strides;
}

bool Dims::operator==(const Dims& other) const {
  return rank_ == other.rank_ && std::equal(values_.begin(), values_.begin() + rank_, other.values_.begin());
}

std::string Dims::text() const {
  return fmt::format("[{}]", fmt::join(values_.begin(), values_.begin() + rank_, ", "));
}

Array::Array(void* its_data, ElementType its_type, Dims its_shape, Device its_device)
    : data(its_data), type(its_type), shape(its_shape), strides(its_shape.contiguous_strides()), device(its_device) {}

std::string Array::text() const {
  return fmt::format("{} {} on {}{}{}", name_of(type), shape.text(), name_of(device),
                     is_contiguous() ? "" : " with strides " + strides.text(), is_read_only ? ", read-only" : "");
}

void Array::check(std::string_view what, ElementType expected_type, bool is_written, const Dims& expected_shape,
                  Device expected_device) const {
  const bool is_as_expected = type == expected_type && shape == expected_shape && device == expected_device &&
                              is_contiguous() && !(is_written && is_read_only) &&
                              (data != nullptr || shape.count() == 0);
  PICTURA_CHECK(is_as_expected, "{}: expected {} {} on {}{}, got {}{}", what, name_of(expected_type),
                expected_shape.text(), name_of(expected_device), is_written ? ", writable" : "", text(),
                data == nullptr && shape.count() != 0 ? " at a null address" : "");
}

}  // namespace pictura
