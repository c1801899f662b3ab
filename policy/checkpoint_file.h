// Format of checkpoint files. A checkpoint contains a policy and all other data that a run needs to continue
// (training/checkpoint.h). A file contains, in this order: the eight bytes PICTCKPT; u32 version; u32 byte order mark;
// u64 length of a JSON header; the header; the data that the header describes; u64 hash (FNV-1a) of all preceding
// bytes. Files of version 1 have no hash at the end; their header contains a hash of the data instead. Only code that
// reads and writes checkpoints should include this header.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pictura/common/error.h"
#include "pictura/policy/stored_policy.h"

namespace pictura {

/// Whether the bytes of a file begin like a checkpoint.
bool is_checkpoint(std::string_view file);

/// Parsed checkpoint. The bytes of the file must outlive the object.
struct CheckpointFile {
  /// Throws Error, which names `path`, if the bytes are not a checkpoint, are truncated or damaged, or have another
  /// version or byte order.
  CheckpointFile(std::string_view file, const std::string& path);

  /// Returns the tensors that a list in the header describes. Throws Error, which names the file and the list, if a
  /// tensor is outside the data.
  std::vector<StoredTensor> tensors(const char* list) const;
  /// Returns the bytes whose offset and size a header entry contains. Throws as tensors() does.
  std::string_view bytes(const char* entry) const;
  /// Returns the policy. Throws Error if its observation schema differs from the current schema; the message names the
  /// first different entry.
  StoredPolicy policy() const;

  std::string path;
  nlohmann::ordered_json header;
  std::string_view data;
};

/// Builder of a checkpoint. Each add function except add_policy() appends to `data` and stores offset and size in the
/// header.
struct CheckpointWriter {
  nlohmann::ordered_json header;
  std::string data;

  /// Adds configuration, observation schema, cameras and counters of a policy to the header.
  void add_policy(const PolicyFacts& policy);
  void add_weights(const StoredPolicy& policy);
  void add_tensors(const char* list, const std::vector<StoredTensor>& tensors);
  void add_bytes(const char* entry, std::string_view bytes);
  /// Returns the bytes of the complete file.
  std::string finish();
};

/// Calls read() and returns its result. Converts a JSON exception of read() to an Error that names the file.
template <typename Read>
auto read_header(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const nlohmann::json::exception& error) {
    fail("{}: its header cannot be read: {}", path, error.what());
  }
}

}  // namespace pictura
