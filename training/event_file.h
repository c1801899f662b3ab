// Writer of TensorBoard event files: TFRecords (length, masked CRC-32C, data, masked CRC-32C) of Event messages
// (TensorFlow's event.proto).
#pragma once

#include <fstream>
#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include "pictura/common/portable/hd.h"

namespace pictura {

using Scalars = std::vector<std::pair<std::string, double>>;

/// Configuration keys with their values as TOML.
using Settings = std::vector<std::pair<std::string, std::string>>;

class EventFile {
 public:
  /// Opens folder/events.out.tfevents.<time>.<process>. Throws Error naming the path.
  explicit EventFile(const std::string& folder);
  /// Appends an event and flushes. Throws Error if the disk is full.
  void write(int64_t step, const Scalars& scalars);
  /// Appends a configuration. Settings that are not lists become hyperparameters; `toml` becomes a text. Throws Error
  /// if the disk is full.
  void write_configuration(const Settings& settings, const std::string& toml);

 private:
  void write_summary(int64_t step, const std::string& summary);
  void write_record(const std::string& event);
  std::string path_;
  std::ofstream out_;
};

}  // namespace pictura
