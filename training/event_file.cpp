#include "pictura/training/event_file.h"

#include <bit>
#include <cerrno>
#include <chrono>
#include <cstring>

#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/crc32c.h"

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

}  // namespace

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
  out_ << length << raw(masked_crc32c(length)) << event << raw(masked_crc32c(event)) << std::flush;
  PICTURA_CHECK(out_, "{}: writing failed: {}", path_, std::strerror(errno));
}

}  // namespace pictura
