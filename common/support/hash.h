// 64-bit hash (FNV-1a over bytes), for comparing the results of runs. It is not secure.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>

#include <fmt/format.h>

#include "pictura/common/span.h"

namespace pictura {

class Hash64 {
 public:
  void add_bytes(const void* data, std::size_t size) {
    const auto* bytes = static_cast<const unsigned char*>(data);
    for (std::size_t i = 0; i < size; ++i) state_ = (state_ ^ bytes[i]) * 0x100000001B3ull;
  }
  /// T must have no padding.
  template <typename T>
  void add(Span<const T> values) {
    add_bytes(values.data(), values.size() * sizeof(T));
  }
  std::uint64_t value() const { return state_; }
  std::string hex() const { return fmt::format("{:016x}", state_); }

 private:
  std::uint64_t state_ = 0xCBF29CE484222325ull;
};

inline std::uint64_t hash_of(std::string_view bytes) {
  Hash64 hash;
  hash.add_bytes(bytes.data(), bytes.size());
  return hash.value();
}

}  // namespace pictura
