#include "pictura/map/womd/tfrecord.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/crc32c.h"
#include "pictura/common/support/regular_file.h"

namespace pictura::womd {

namespace {

constexpr std::size_t kLength_bytes = 8, kSum_bytes = 4, kHeader_bytes = kLength_bytes + kSum_bytes;

template <typename T>
T number_at(std::string_view bytes, std::size_t at) {
  T value;
  std::memcpy(&value, bytes.data() + at, sizeof value);
  return value;
}

}  // namespace

FileBytes::FileBytes(const std::string& path) : path_(path) {
  require_regular_file(path);
  file_.reset(::open(path.c_str(), O_RDONLY | O_CLOEXEC));
  PICTURA_CHECK(file_.get() >= 0, "{}: cannot be opened: {}", path, std::strerror(errno));
  struct stat status{};
  PICTURA_CHECK(::fstat(file_.get(), &status) == 0, "{}: cannot be read: {}", path, std::strerror(errno));
  PICTURA_CHECK(S_ISREG(status.st_mode), "{}: expected a regular file", path);
  size_ = static_cast<uint64_t>(status.st_size);
}

std::string FileBytes::read(uint64_t offset, std::size_t count) const {
  std::string bytes(count, '\0');
  for (std::size_t done = 0; done < count;) {
    const ssize_t got = ::pread(file_.get(), bytes.data() + done, count - done, static_cast<off_t>(offset + done));
    if (got < 0 && errno == EINTR) continue;
    PICTURA_CHECK(got >= 0, "{}: cannot be read: {}", path_, std::strerror(errno));
    PICTURA_CHECK(got > 0, "{}: became shorter while it was read: expected {} bytes at {}, got {}", path_, count,
                  offset, done);
    done += static_cast<std::size_t>(got);
  }
  return bytes;
}

RecordList list_records(const ByteSource& source, const std::string& name) {
  RecordList list;
  const uint64_t size = source.size();
  for (uint64_t at = 0; at < size;) {
    const std::size_t k = list.records.size();
    if (size - at < kHeader_bytes) {
      list.fault = fmt::format("{}: record {}: truncated: expected {} bytes of length and checksum at {}, got {}", name,
                               k, kHeader_bytes, at, size - at);
      break;
    }
    const std::string header = source.read(at, kHeader_bytes);
    const auto length = number_at<uint64_t>(header, 0);
    const auto sum = number_at<uint32_t>(header, kLength_bytes);
    if (const uint32_t expected = masked_crc32c(std::string_view(header).substr(0, kLength_bytes)); sum != expected) {
      list.fault = fmt::format(
          "{}: record {}: expected the checksum {:08x} of its length at {}, got {:08x}: damaged, or not a TFRecord "
          "file",
          name, k, expected, at, sum);
      break;
    }
    if (length > kMaxRecord_bytes) {
      list.fault = fmt::format("{}: record {}: expected a length of at most {} bytes, got {}", name, k,
                               kMaxRecord_bytes, length);
      break;
    }
    const uint64_t payload = at + kHeader_bytes;
    if (size - payload < length + kSum_bytes) {
      list.fault = fmt::format("{}: record {}: truncated: expected {} bytes at {}, got {}", name, k,
                               length + kSum_bytes, payload, size - payload);
      break;
    }
    const auto payload_sum = number_at<uint32_t>(source.read(payload + length, kSum_bytes), 0);
    list.records.push_back({payload, length, payload_sum});
    at = payload + length + kSum_bytes;
  }
  return list;
}

std::string read_record(const ByteSource& source, const std::string& name, std::size_t k, RecordPlace place) {
  std::string bytes = source.read(place.offset, static_cast<std::size_t>(place.bytes) + kSum_bytes);
  const auto sum = number_at<uint32_t>(bytes, static_cast<std::size_t>(place.bytes));
  bytes.resize(place.bytes);
  const uint32_t expected = masked_crc32c(bytes);
  PICTURA_CHECK(sum == expected, "{}: record {}: expected the checksum {:08x} of its {} bytes, got {:08x}", name, k,
                expected, place.bytes, sum);
  return bytes;
}

}  // namespace pictura::womd
