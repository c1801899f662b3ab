#include "pictura/training/event_file.h"

#include <array>
#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>

#include <unistd.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

double wall_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

template <typename T>
std::string raw(T value) {
  static_assert(std::endian::native == std::endian::little, "TFRecords are little endian");
  return {reinterpret_cast<const char*>(&value), sizeof value};
}

// The wire format of protocol buffers: a varint (field << 3 | kind), then the value.
std::string varint(uint64_t value) {
  std::string bytes;
  for (; value >= 0x80; value >>= 7) bytes += static_cast<char>(value | 0x80);
  return bytes + static_cast<char>(value);
}
std::string field_varint(uint32_t field, uint64_t value) { return varint(field << 3) + varint(value); }
std::string field_double(uint32_t field, double value) { return varint(field << 3 | 1) + raw(value); }
std::string field_float(uint32_t field, float value) { return varint(field << 3 | 5) + raw(value); }
std::string field_bytes(uint32_t field, std::string_view bytes) {
  return varint(field << 3 | 2) + varint(bytes.size()) + std::string(bytes);
}

uint32_t masked_crc(std::string_view bytes) {
  const uint32_t crc = crc32c(bytes);
  return ((crc >> 15) | (crc << 17)) + 0xA282EAD8u;
}

}  // namespace

uint32_t crc32c(std::string_view bytes) {
  static const auto table = [] {
    std::array<uint32_t, 256> entries{};
    for (uint32_t i = 0; i < 256; ++i) {
      entries[i] = i;
      for (int bit = 0; bit < 8; ++bit) entries[i] = (entries[i] >> 1) ^ ((entries[i] & 1) ? 0x82F63B78u : 0);
    }
    return entries;
  }();
  uint32_t crc = 0xFFFFFFFFu;
  for (const char c : bytes) crc = (crc >> 8) ^ table[(crc ^ static_cast<uint8_t>(c)) & 0xFFu];
  return ~crc;
}

EventFile::EventFile(const std::string& folder)
    : path_(fmt::format("{}/events.out.tfevents.{:.0f}.{}", folder, wall_time_s(), getpid())),
      out_(path_, std::ios::binary) {
  PICTURA_CHECK(out_, "{}: cannot be opened for writing", path_);
  write_record(field_double(1, wall_time_s()) + field_bytes(3, "brain.Event:2"));
}

void EventFile::write(int64_t step, const Scalars& scalars) {
  std::string summary;
  for (const auto& [tag, value] : scalars) {
    summary += field_bytes(1, field_bytes(1, tag) + field_float(2, static_cast<float>(value)));
  }
  write_record(field_double(1, wall_time_s()) + field_varint(2, static_cast<uint64_t>(step)) + field_bytes(5, summary));
}

void EventFile::write_record(const std::string& event) {
  const std::string length = raw(static_cast<uint64_t>(event.size()));
  out_ << length << raw(masked_crc(length)) << event << raw(masked_crc(event)) << std::flush;
  PICTURA_CHECK(out_, "{}: writing failed: {}", path_, std::strerror(errno));
}

}  // namespace pictura
