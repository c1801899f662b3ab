// Writer of all output files. A reader never sees an incomplete file, and a full disk leaves the old file unchanged.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include <sys/stat.h>

#include "pictura/common/error_types.h"

namespace pictura {

/// A file descriptor that closes itself.
class Descriptor {
 public:
  Descriptor() = default;
  explicit Descriptor(int fd) : fd_(fd) {}
  ~Descriptor() { reset(); }
  Descriptor(const Descriptor&) = delete;
  Descriptor& operator=(const Descriptor&) = delete;
  int get() const { return fd_; }
  void reset(int fd = -1);

 private:
  int fd_ = -1;
};

/// Storage of the bytes before commit(). unnamed: a file without a name, if the file system supports it. named: a
/// hidden file next to the target. A later writer in the folder removes hidden files of killed writers.
enum class Staging { unnamed, named };

/// Whether a name has the form of hidden files of Staging::named: .pictura-*.tmp with 16 hexadecimal digits.
bool is_temporary_name(std::string_view name);

class OutputFile {
 public:
  /// Opens a path, following links. commit() replaces a regular file, and keeps its mode and, where possible, its
  /// owner. commit() writes into other targets, such as devices, FIFOs and /dev/stdout. Throws Error if the target is a
  /// folder or cannot be written.
  explicit OutputFile(const std::string& path, Staging staging = Staging::unnamed);
  /// Leaves the target unchanged unless commit() was called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Throws Error when the disk is full.
  void write(std::string_view bytes);
  /// Descriptor of the stored bytes: a seekable regular file, open for reading and writing.
  int fd() const { return staged_.get(); }

  /// Syncs the bytes to disk, and makes them the target's content. Waits for a FIFO's reader. Throws Error if this
  /// fails, and Interrupted if a signal ends the wait.
  void commit();

 private:
  std::string staging_folder() const;
  void stage_unnamed();
  void stage_named();
  void write_through();
  void replace();

  std::string path_;
  std::string target_;  // with links followed, except those of /proc
  bool is_through_;     // commit() does not replace the target
  std::optional<struct stat> replaced_;
  std::string temporary_;  // name of staged_, or empty
  Descriptor staged_;
};

}  // namespace pictura
