// Writer of MCAP files (https://mcap.dev/spec) with uncompressed chunks and indexes.
#pragma once

#include <cstdint>
#include <map>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/support/output_file.h"

namespace pictura {

class McapWriter {
 public:
  /// Every function that writes throws Error naming the path.
  McapWriter(const std::string& path, std::string_view library);

  /// Adds a topic with a JSON Schema. Returns its channel.
  uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema);
  /// Adds entries that describe the whole file.
  void add_metadata(std::string_view name, const std::vector<std::pair<std::string, std::string>>& entries);
  void add_message(uint16_t channel, uint64_t time_ns, std::string_view json);
  /// Completes the file, and renames it to `path`.
  void finish();

 private:
  struct ChunkIndex {
    uint64_t first_ns, last_ns, offset, length, records_bytes, index_bytes;
    std::map<uint16_t, uint64_t> index_offsets;  // by channel
  };
  void put(std::string_view bytes);
  void end_chunk();

  OutputFile file_;
  uint64_t offset_ = 0;
  std::string schemas_, channels_;  // for the summary, whose records must be grouped by kind
  std::string metadata_indexes_;
  uint16_t num_channels_ = 0;
  std::string chunk_;
  uint64_t first_ns_ = 0, last_ns_ = 0;
  // Times and offsets of messages, by channel.
  std::map<uint16_t, std::vector<std::pair<uint64_t, uint64_t>>> entries_;
  std::map<uint16_t, uint64_t> counts_;
  std::vector<ChunkIndex> chunks_;
  uint64_t num_messages_ = 0, num_metadata_ = 0, begin_ns_ = 0, end_ns_ = 0;
};

}  // namespace pictura
