// Checkpoint file: a policy, which sessions read, and all other data that a run needs to continue
// (training/checkpoint.h). Layout: the eight bytes PICTCKPT, u32 version, u32 byte order mark, u64 length of a JSON
// header, the header, the data that the header describes, u64 hash (FNV-1a) of all preceding bytes. Version 1 has no
// hash at its end; its header holds a hash of the data. Only code that reads and writes checkpoints should include this
// header.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pictura/common/error.h"
#include "pictura/policy/stored_policy.h"

namespace pictura {

/// Whether the bytes of a file begin like those of a checkpoint.
bool is_checkpoint(std::string_view file);

/// Header and data of a checkpoint's bytes. The bytes must outlive the object.
struct CheckpointFile {
  /// Throws Error naming `path` if the bytes are not a checkpoint, are truncated or damaged, or have another version or
  /// byte order.
  CheckpointFile(std::string_view file, const std::string& path);

  /// Returns the tensors of a list in the header. Throws Error naming the file and the list if a tensor lies outside
  /// the data.
  std::vector<StoredTensor> tensors(const char* list) const;
  /// Returns the bytes of a header entry that holds offset and size. Throws as tensors() does.
  std::string_view bytes(const char* entry) const;
  /// Returns the policy. Throws Error naming the entry of the observation schema that differs from the current schema.
  StoredPolicy policy() const;

  std::string path;
  nlohmann::ordered_json header;
  std::string_view data;
};

/// Builder of a checkpoint. Each part's data are appended to `data`, and the header records where the part begins.
struct CheckpointWriter {
  nlohmann::ordered_json header;
  std::string data;

  /// Adds configuration, schema, rig and counters of a policy, without its weights.
  void add_policy(const PolicyFacts& policy);
  void add_weights(const StoredPolicy& policy);
  void add_tensors(const char* list, const std::vector<StoredTensor>& tensors);
  void add_bytes(const char* entry, std::string_view bytes);
  /// Returns the bytes of the complete file.
  std::string finish();
};

/// Calls read() and returns its result. Throws Error naming the file if read() throws a JSON exception.
template <typename Read>
auto read_header(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const nlohmann::json::exception& error) {
    fail("{}: its header cannot be read: {}", path, error.what());
  }
}

}  // namespace pictura
