// The file of a checkpoint: a policy, which sessions read, and all else that a run needs to go on
// (training/checkpoint.h). Layout: the eight bytes PICTCKPT, u32 version, u32 byte order mark, u64 length of a JSON
// header, the header, the data that it describes, u64 hash (FNV-1a) of all bytes before. Version 1 has no such hash:
// its header names one of the data. Only for the files that read and write them.
#pragma once

#include <string>
#include <string_view>
#include <vector>

#include <nlohmann/json.hpp>

#include "pictura/common/error.h"
#include "pictura/policy/saved_policy.h"

namespace pictura {

/// Whether the bytes of a file begin as those of a checkpoint do.
bool is_checkpoint(std::string_view file);

/// Header and data of a checkpoint's bytes, which must outlive it.
struct CheckpointFile {
  /// Throws Error naming `path` where the bytes are no checkpoint, truncated, damaged, or of another version or byte
  /// order.
  CheckpointFile(std::string_view file, const std::string& path);

  /// The tensors of a list of the header. Throws Error naming the file and the list where one lies outside the data.
  std::vector<NamedTensor> tensors(const char* list) const;
  /// The bytes of an entry of the header that names offset and bytes. Throws as tensors() does.
  std::string_view bytes(const char* entry) const;
  /// The policy in it. Throws Error naming the entry of the observation schema that differs from today's.
  SavedPolicy policy() const;

  std::string path;
  nlohmann::ordered_json header;
  std::string_view data;
};

/// A checkpoint that is being put together: data are appended, and the header says where each begins.
struct CheckpointWriter {
  nlohmann::ordered_json header;
  std::string data;

  /// Configuration, schema, rig and counters of a policy; its weights follow where add_weights() is called.
  void add_policy(const SavedPolicy& policy);
  void add_weights(const SavedPolicy& policy);
  void add_tensors(const char* list, const std::vector<NamedTensor>& tensors);
  void add_bytes(const char* entry, std::string_view bytes);
  /// The bytes of the whole file.
  std::string finish();
};

/// Calls read() and returns its result. Throws Error naming the file where read() throws an exception of JSON.
template <typename Read>
auto read_header(const std::string& path, const Read& read) {
  try {
    return read();
  } catch (const nlohmann::json::exception& error) {
    fail("{}: its header cannot be read: {}", path, error.what());
  }
}

}  // namespace pictura
