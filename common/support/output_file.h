// Writer of all output files. Bytes go into a file without a name, and only a complete file gets a name. So a reader
// never sees half a file, a full disk leaves the old file unchanged, and a killed process leaves at most a hidden file
// behind.
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

/// Storage of the bytes before commit(). unnamed: a file without a name, or `named` if the file system has no such
/// files. named: a hidden file next to the target. If its writer is killed, the next writer in that folder removes the
/// hidden file.
enum class Staging { unnamed, named };

/// Whether a name is that of a hidden file of Staging::named: .pictura-*.tmp with 16 random hexadecimal digits, unlike
/// any name that a user would choose.
bool is_temporary_name(std::string_view name);

class OutputFile {
 public:
  /// Opens a path for writing, and follows links. A target that is not a regular file (a device, a FIFO), or that is
  /// reached by a link in /proc (as through /dev/stdout), is never replaced: commit() writes into it. If a regular file
  /// is replaced, the new file gets its mode and, where possible, its owner. Throws Error for folders, read-only files
  /// and other targets that cannot be written; the message names the path.
  explicit OutputFile(const std::string& path, Staging staging = Staging::unnamed);
  /// Leaves the target unchanged unless commit() was called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends bytes. Throws Error naming the path when the disk is full.
  void write(std::string_view bytes);
  /// Descriptor of the stored bytes, for code that writes to a descriptor. It is a seekable regular file, open for
  /// reading and writing.
  int fd() const { return staged_.get(); }

  /// Syncs the stored bytes to disk and makes them the target's content. Waits for a FIFO's reader. Throws Error naming
  /// the path, and Interrupted if a signal ends the wait.
  void commit();

 private:
  std::string staging_folder() const;
  void stage_unnamed();
  void stage_named();
  void write_through();
  void replace();

  std::string path_;                     // as given by the caller, for messages
  std::string target_;                   // with links followed, except those of /proc
  bool is_through_;                      // commit() writes into the target instead of replacing it
  std::optional<struct stat> replaced_;  // the file that commit() replaces
  std::string temporary_;                // the name of staged_, empty while it has none
  Descriptor staged_;
};

}  // namespace pictura
