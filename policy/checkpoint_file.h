// Format of checkpoint files (training/checkpoint.h): the eight bytes PICTCKPT; u32 version; u32 byte order mark; u64
// length of a JSON header; the header; the data that it describes; u64 hash (FNV-1a) of all preceding bytes. In version
// 1, the header contains a hash of the data instead.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pictura/common/error.h"
#include "pictura/policy/stored_policy.h"

namespace pictura {

/// Whether a file begins like a checkpoint.
bool is_checkpoint(std::string_view file);

/// Parsed checkpoint. The file's bytes must outlive it.
struct CheckpointFile {
  /// Throws Error naming `path` if the bytes are not a checkpoint, are truncated or damaged, or have another version or
  /// byte order.
  CheckpointFile(std::string_view file, const std::string& path);

  /// Returns the tensors of a list in the header. Throws Error naming file and list if a tensor is outside the data.
  std::vector<StoredTensor> tensors(const char* list) const;
  /// Returns the bytes of a header entry. Throws as tensors() does.
  std::string_view bytes(const char* entry) const;
  /// Throws Error naming the first different entry if the saved observation schema is not the current one.
  StoredPolicy policy() const;

  std::string path;
  nlohmann::ordered_json header;
  std::string_view data;
};

/// Builder of a checkpoint.
struct CheckpointWriter {
  nlohmann::ordered_json header;
  std::string data;

  /// Adds configuration, observation schema, cameras and counters to the header.
  void add_policy(const PolicyFacts& policy);
  void add_weights(const StoredPolicy& policy);
  void add_tensors(const char* list, const std::vector<StoredTensor>& tensors);
  void add_bytes(const char* entry, std::string_view bytes);
  /// Returns the complete file.
  std::string finish();
};

/// Returns read(); converts its JSON exceptions to an Error naming the file.
template <typename Read>
auto read_header(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const nlohmann::json::exception& error) {
    fail("{}: its header cannot be read: {}", path, error.what());
  }
}

}  // namespace pictura
