// The container of an MCAP file (https://mcap.dev/spec): schemas, channels, messages in uncompressed chunks, and the
// indexes by which readers seek.
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
  /// Throws Error naming the path, as all that writes does.
  McapWriter(const std::string& path, std::string_view library);

  /// A topic of JSON messages by a schema in JSON Schema. Returns its channel.
  uint16_t add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema);
  /// Names and texts that describe the whole file.
  void add_metadata(std::string_view name, const std::vector<std::pair<std::string, std::string>>& entries);
  void add_message(uint16_t channel, uint64_t time_ns, std::string_view json);
  /// Writes what is left, and gives the file its name.
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
  std::string definitions_;  // the schemas and channels, again in the summary
  std::string metadata_indexes_;
  uint16_t num_channels_ = 0;
  std::string chunk_;
  uint64_t first_ns_ = 0, last_ns_ = 0;
  std::map<uint16_t, std::vector<std::pair<uint64_t, uint64_t>>> entries_;  // of the chunk: time and offset of messages
  std::map<uint16_t, uint64_t> counts_;
  std::vector<ChunkIndex> chunks_;
  uint64_t num_messages_ = 0, num_metadata_ = 0, begin_ns_ = 0, end_ns_ = 0;
};

}  // namespace pictura
