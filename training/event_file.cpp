#include "pictura/training/event_file.h"

#include <cerrno>
#include <chrono>
#include <cstring>

#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/crc32c.h"
#include "pictura/common/support/protobuf_writer.h"

namespace pictura {

namespace {

double wall_time_s() {
  return std::chrono::duration<double>(std::chrono::system_clock::now().time_since_epoch()).count();
}

}  // namespace

EventFile::EventFile(const std::string& folder)
    : path_(fmt::format("{}/events.out.tfevents.{:.0f}.{}", folder, wall_time_s(), getpid())),
      out_(path_, std::ios::binary) {
  PICTURA_CHECK(out_, "{}: cannot be opened for writing", path_);
  std::string version;
  append_double(1, wall_time_s(), &version);
  append_bytes(3, "brain.Event:2", &version);
  write_record(version);
}

void EventFile::write(int64_t step, const Scalars& scalars) {
  std::string summary;
  for (const auto& [tag, value] : scalars) {
    std::string scalar;
    append_bytes(1, tag, &scalar);
    append_float(2, static_cast<float>(value), &scalar);
    append_bytes(1, scalar, &summary);
  }
  std::string event;
  append_double(1, wall_time_s(), &event);
  append_integer(2, static_cast<uint64_t>(step), &event);
  append_bytes(5, summary, &event);
  write_record(event);
}

void EventFile::write_record(const std::string& event) {
  const uint64_t size = event.size();
  const std::string_view length = bytes_of(size);
  const uint32_t length_crc = masked_crc32c(length), event_crc = masked_crc32c(event);
  out_ << length << bytes_of(length_crc) << event << bytes_of(event_crc) << std::flush;
  PICTURA_CHECK(out_, "{}: writing failed: {}", path_, std::strerror(errno));
}

}  // namespace pictura
