#include "pictura/replay/mcap_writer.h"

#include <algorithm>

#include <zlib.h>

namespace pictura {

namespace {

constexpr std::string_view kMagic("\x89MCAP0\r\n", 8);
constexpr size_t kChunkBytes = size_t{1} << 20;

enum class Op : uint8_t {
  header = 1,
  footer = 2,
  schema = 3,
  channel = 4,
  message = 5,
  chunk = 6,
  message_index = 7,
  chunk_index = 8,
  statistics = 11,
  metadata = 12,
  metadata_index = 13,
  data_end = 15,
};

/// Appends a number in little-endian order.
template <typename Number>
void put_fixed(Number value, std::string* bytes_inout) {
  for (size_t i = 0; i < sizeof(Number); ++i) {
    *bytes_inout += static_cast<char>(static_cast<uint64_t>(value) >> (8 * i) & 255);
  }
}
void put_text(std::string_view text, std::string* bytes_inout) {
  put_fixed(static_cast<uint32_t>(text.size()), bytes_inout);
  *bytes_inout += text;
}

std::string record(Op op, std::string_view content) {
  std::string bytes(1, static_cast<char>(op));
  put_fixed(static_cast<uint64_t>(content.size()), &bytes);
  bytes += content;
  return bytes;
}

uint32_t crc_of(std::string_view bytes, uint32_t before = 0) {
  return static_cast<uint32_t>(crc32_z(before, reinterpret_cast<const unsigned char*>(bytes.data()), bytes.size()));
}

/// Encodes a map from channels to numbers: its size in bytes, then its entries.
std::string channel_map(const std::map<uint16_t, uint64_t>& values) {
  std::string entries, bytes;
  for (const auto& [channel, value] : values) {
    put_fixed(channel, &entries);
    put_fixed(value, &entries);
  }
  put_text(entries, &bytes);
  return bytes;
}

}  // namespace

McapWriter::McapWriter(const std::string& path, std::string_view library) : file_(path) {
  put(kMagic);
  std::string content;
  put_text("", &content);  // no profile
  put_text(library, &content);
  put(record(Op::header, content));
}

void McapWriter::put(std::string_view bytes) {
  file_.write(bytes);
  offset_ += bytes.size();
}

uint16_t McapWriter::add_channel(std::string_view topic, std::string_view schema_name, std::string_view schema) {
  const uint16_t id = ++num_channels_;  // id of the channel and of its schema; 0 is reserved
  std::string content;
  put_fixed(id, &content);
  put_text(schema_name, &content);
  put_text("jsonschema", &content);
  put_text(schema, &content);
  const std::string schema_record = record(Op::schema, content);
  content.clear();
  put_fixed(id, &content);
  put_fixed(id, &content);
  put_text(topic, &content);
  put_text("json", &content);
  put_text("", &content);  // no metadata
  const std::string channel_record = record(Op::channel, content);
  schemas_ += schema_record;
  channels_ += channel_record;
  chunk_ += schema_record + channel_record;
  return id;
}

void McapWriter::add_metadata(std::string_view name, const std::vector<std::pair<std::string, std::string>>& entries) {
  end_chunk();
  std::string map, content;
  for (const auto& [key, value] : entries) {
    put_text(key, &map);
    put_text(value, &map);
  }
  put_text(name, &content);
  put_text(map, &content);
  const std::string bytes = record(Op::metadata, content);
  content.clear();
  put_fixed(offset_, &content);
  put_fixed(static_cast<uint64_t>(bytes.size()), &content);
  put_text(name, &content);
  metadata_indexes_ += record(Op::metadata_index, content);
  ++num_metadata_;
  put(bytes);
}

void McapWriter::add_message(uint16_t channel, uint64_t time_ns, std::string_view json) {
  std::string content;
  put_fixed(channel, &content);
  put_fixed(static_cast<uint32_t>(counts_[channel]++), &content);
  put_fixed(time_ns, &content);
  put_fixed(time_ns, &content);
  content += json;
  first_ns_ = entries_.empty() ? time_ns : std::min(first_ns_, time_ns);
  last_ns_ = entries_.empty() ? time_ns : std::max(last_ns_, time_ns);
  begin_ns_ = num_messages_ == 0 ? time_ns : std::min(begin_ns_, time_ns);
  end_ns_ = std::max(end_ns_, time_ns);
  entries_[channel].emplace_back(time_ns, chunk_.size());
  ++num_messages_;
  chunk_ += record(Op::message, content);
  if (chunk_.size() >= kChunkBytes) end_chunk();
}

void McapWriter::end_chunk() {
  if (chunk_.empty()) return;
  std::string content;
  put_fixed(entries_.empty() ? uint64_t{0} : first_ns_, &content);
  put_fixed(entries_.empty() ? uint64_t{0} : last_ns_, &content);
  put_fixed(static_cast<uint64_t>(chunk_.size()), &content);
  put_fixed(crc_of(chunk_), &content);
  put_text("", &content);  // not compressed
  put_fixed(static_cast<uint64_t>(chunk_.size()), &content);
  content += chunk_;
  ChunkIndex index{entries_.empty() ? 0 : first_ns_, entries_.empty() ? 0 : last_ns_, offset_, 0, chunk_.size(), 0, {}};
  const std::string bytes = record(Op::chunk, content);
  index.length = bytes.size();
  put(bytes);
  const uint64_t indexes_begin = offset_;
  for (const auto& [channel, entries] : entries_) {
    std::string places;
    for (const auto& [time_ns, offset] : entries) {
      put_fixed(time_ns, &places);
      put_fixed(offset, &places);
    }
    content.clear();
    put_fixed(channel, &content);
    put_text(places, &content);
    index.index_offsets[channel] = offset_;
    put(record(Op::message_index, content));
  }
  index.index_bytes = offset_ - indexes_begin;
  chunks_.push_back(std::move(index));
  chunk_.clear();
  entries_.clear();
}

void McapWriter::finish() {
  end_chunk();
  std::string content;
  put_fixed(uint32_t{0}, &content);  // no checksum over all data
  put(record(Op::data_end, content));
  const uint64_t summary_begin = offset_;
  std::string summary = schemas_ + channels_;
  content.clear();
  put_fixed(num_messages_, &content);
  put_fixed(num_channels_, &content);  // number of schemas
  put_fixed(uint32_t{num_channels_}, &content);
  put_fixed(uint32_t{0}, &content);  // attachments
  put_fixed(static_cast<uint32_t>(num_metadata_), &content);
  put_fixed(static_cast<uint32_t>(chunks_.size()), &content);
  put_fixed(begin_ns_, &content);
  put_fixed(end_ns_, &content);
  content += channel_map(counts_);
  summary += record(Op::statistics, content);
  for (const ChunkIndex& chunk : chunks_) {
    content.clear();
    for (const uint64_t value : {chunk.first_ns, chunk.last_ns, chunk.offset, chunk.length}) put_fixed(value, &content);
    content += channel_map(chunk.index_offsets);
    put_fixed(chunk.index_bytes, &content);
    put_text("", &content);  // not compressed
    put_fixed(chunk.records_bytes, &content);
    put_fixed(chunk.records_bytes, &content);
    summary += record(Op::chunk_index, content);
  }
  summary += metadata_indexes_;
  put(summary);
  // The checksum covers the summary and the footer's first fields.
  content.clear();
  put_fixed(summary_begin, &content);
  put_fixed(uint64_t{0}, &content);  // the summary has no offset section
  std::string begin_of_footer(1, static_cast<char>(Op::footer));
  put_fixed(static_cast<uint64_t>(content.size() + sizeof(uint32_t)), &begin_of_footer);
  put_fixed(crc_of(begin_of_footer + content, crc_of(summary)), &content);
  put(record(Op::footer, content));
  put(kMagic);
  file_.commit();
}

}  // namespace pictura
