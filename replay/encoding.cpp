#include "pictura/replay/encoding.h"

#include <algorithm>
#include <array>

#include <zlib.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

constexpr std::string_view kDigits = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789+/";
constexpr uint8_t kNoDigit = 0xFF;

constexpr std::array<uint8_t, 256> digit_values() {
  std::array<uint8_t, 256> values{};
  for (uint8_t& value : values) value = kNoDigit;
  for (std::size_t i = 0; i < kDigits.size(); ++i) values[static_cast<uint8_t>(kDigits[i])] = static_cast<uint8_t>(i);
  return values;
}

}  // namespace

void put_number(int32_t value, std::string* bytes_inout) {
  const auto bits = static_cast<uint32_t>(value);
  uint32_t rest = (bits << 1) ^ (value < 0 ? 0xFFFFFFFFu : 0u);
  for (; rest >= 0x80; rest >>= 7) bytes_inout->push_back(static_cast<char>(rest | 0x80));
  bytes_inout->push_back(static_cast<char>(rest));
}

int32_t NumberReader::next() {
  uint32_t bits = 0;
  for (int shift = 0; shift < 35; shift += 7) {
    PICTURA_CHECK(at_ < bytes_.size(), "the numbers are truncated after {} bytes", bytes_.size());
    const auto byte = static_cast<uint8_t>(bytes_[at_++]);
    bits |= static_cast<uint32_t>(byte & 0x7F) << shift;
    if (byte < 0x80) return static_cast<int32_t>((bits >> 1) ^ (0u - (bits & 1)));
  }
  fail("expected a number of up to five bytes before byte {}", at_);
}

int32_t NumberReader::next_count() {
  const int32_t count = next();
  PICTURA_CHECK(count >= 0 && static_cast<std::size_t>(count) <= bytes_.size() - at_,
                "expected a count of at most {}, the remaining bytes, got {}", bytes_.size() - at_, count);
  return count;
}

void put_differences(const int32_t* first, std::size_t count, std::size_t stride, int order, std::string* bytes_inout) {
  uint32_t before = 0, difference_before = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto value = static_cast<uint32_t>(first[i * stride]);
    const uint32_t difference = value - before;
    put_number(static_cast<int32_t>(order == 0   ? value
                                    : order == 1 ? difference
                                                 : difference - difference_before),
               bytes_inout);
    before = value;
    difference_before = difference;
  }
}

void read_differences(NumberReader* reader, std::size_t count, std::size_t stride, int order, int32_t* first_out) {
  uint32_t value = 0, difference = 0;
  for (std::size_t i = 0; i < count; ++i) {
    const auto next = static_cast<uint32_t>(reader->next());
    difference = order == 2 ? difference + next : next;
    value = order == 0 ? next : value + difference;
    first_out[i * stride] = static_cast<int32_t>(value);
  }
}

std::string deflate(std::string_view bytes) {
  uLongf size = compressBound(bytes.size());
  std::string stream(size, '\0');
  const int status = compress2(reinterpret_cast<Bytef*>(stream.data()), &size,
                               reinterpret_cast<const Bytef*>(bytes.data()), bytes.size(), Z_BEST_COMPRESSION);
  PICTURA_CHECK(status == Z_OK, "zlib: cannot compress {} bytes: status {}", bytes.size(), status);
  stream.resize(size);
  return stream;
}

std::string inflate(std::string_view stream, std::size_t size) {
  // A zlib stream has at least about a thousandth of the size of its content.
  PICTURA_CHECK(size / 1040 <= stream.size(), "expected a zlib stream of {} bytes, got {} bytes", size, stream.size());
  std::string bytes(size, '\0');
  uLongf inflated = size;
  const int status = uncompress(reinterpret_cast<Bytef*>(bytes.data()), &inflated,
                                reinterpret_cast<const Bytef*>(stream.data()), stream.size());
  PICTURA_CHECK(status == Z_OK && inflated == size, "expected a zlib stream of {} bytes, got a damaged stream", size);
  return bytes;
}

std::string base64(std::string_view bytes) {
  std::string text;
  text.reserve((bytes.size() + 2) / 3 * 4);
  for (std::size_t i = 0; i < bytes.size(); i += 3) {
    uint32_t bits = 0;
    const std::size_t count = std::min<std::size_t>(3, bytes.size() - i);
    for (std::size_t j = 0; j < 3; ++j) bits = bits << 8 | (j < count ? static_cast<uint8_t>(bytes[i + j]) : 0u);
    for (std::size_t j = 0; j < 4; ++j) text.push_back(j <= count ? kDigits[bits >> (18 - 6 * j) & 63] : '=');
  }
  return text;
}

std::string from_base64(std::string_view text) {
  static constexpr std::array<uint8_t, 256> kValues = digit_values();
  PICTURA_CHECK(text.size() % 4 == 0, "base64: expected groups of 4 letters, got {} letters", text.size());
  std::size_t padding = 0;
  while (padding < 2 && padding < text.size() && text[text.size() - 1 - padding] == '=') ++padding;
  std::string bytes;
  bytes.reserve(text.size() / 4 * 3);
  uint32_t bits = 0;
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool is_padding = i + padding >= text.size();
    const uint8_t value = is_padding ? 0 : kValues[static_cast<uint8_t>(text[i])];
    PICTURA_CHECK(value != kNoDigit, "base64: expected a letter, a digit, + or / at {}", i);
    bits = bits << 6 | value;
    if (i % 4 != 3) continue;
    for (int shift = 16; shift >= 0; shift -= 8) bytes.push_back(static_cast<char>(bits >> shift & 0xFF));
    bits = 0;
  }
  bytes.resize(bytes.size() - padding);
  return bytes;
}

}  // namespace pictura
