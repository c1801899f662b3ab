// TFRecord files: records of bytes, each with its length and two checksums.
#pragma once

#include <cstdint>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/support/output_file.h"

namespace pictura::womd {

/// Source of bytes with random access.
class ByteSource {
 public:
  virtual ~ByteSource() = default;
  virtual uint64_t size() const = 0;
  /// The bytes must be within size(). Throws Error, which names the file, on failure.
  virtual std::string read(uint64_t offset, std::size_t count) const = 0;
};

/// Bytes of a regular file. The constructor throws Error, which names the path, for other files and on failure.
class FileBytes : public ByteSource {
 public:
  explicit FileBytes(const std::string& path);
  uint64_t size() const override { return size_; }
  std::string read(uint64_t offset, std::size_t count) const override;

 private:
  std::string path_;
  Descriptor file_;
  uint64_t size_ = 0;
};

class MemoryBytes : public ByteSource {
 public:
  explicit MemoryBytes(std::string_view bytes) : bytes_(bytes) {}
  uint64_t size() const override { return bytes_.size(); }
  std::string read(uint64_t offset, std::size_t count) const override {
    return std::string(bytes_.substr(static_cast<std::size_t>(offset), count));
  }

 private:
  std::string_view bytes_;
};

/// Place and checksum of a record's payload.
struct RecordPlace {
  uint64_t offset = 0, bytes = 0;
  uint32_t sum = 0;
};

constexpr uint64_t kMaxRecord_bytes = uint64_t{1} << 28;

struct RecordList {
  std::vector<RecordPlace> records;
  std::string fault;  // why the list ends early, or empty
};

/// Verifies the checksums of the lengths. `name` is the file's name in RecordList::fault.
RecordList list_records(const ByteSource& source, const std::string& name);

/// `k` is the record's number in messages. Throws Error "NAME: record K: ..." if the payload does not match its
/// checksum.
std::string read_record(const ByteSource& source, const std::string& name, std::size_t k, RecordPlace place);

}  // namespace pictura::womd
