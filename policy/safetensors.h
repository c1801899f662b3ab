// Writer of the safetensors format (https://github.com/huggingface/safetensors): length of a JSON header (u64), the
// header, and raw data.
#pragma once

#include <bit>
#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

namespace pictura {

enum class SafeType : uint8_t { f32, bf16, i64 };

/// Returns a type's name in the header.
std::string_view name_of(SafeType type);

struct SafeTensor {
  std::string name;
  SafeType type = SafeType::f32;
  std::vector<int64_t> shape;
  std::string bytes;  // little endian, in row-major order
};

/// Returns a file's bytes. metadata: a JSON object of strings.
std::string safetensors(const std::vector<SafeTensor>& tensors, const nlohmann::ordered_json& metadata);

/// Returns the nearest bfloat16 of a finite number, ties to even.
inline uint16_t bf16_of(float value) {
  const auto bits = std::bit_cast<uint32_t>(value);
  return static_cast<uint16_t>((bits + 0x7FFFu + ((bits >> 16) & 1u)) >> 16);
}

}  // namespace pictura
