// The only writer of output files. Bytes go into a file without a name, and only a complete file gets a name. So a
// reader never sees half a file, a full disk leaves the old file, and a killed process leaves nothing behind.
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

/// Storage of bytes before commit(): a file without a name wherever the file system allows it. Otherwise, and for
/// tests, a hidden file beside the target; if its writer is killed, the next writer into that folder removes it.
enum class Staging { unnamed, named };

/// Whether a name is that of a hidden file of Staging::named: .pictura-*.tmp with 16 random hexadecimal digits, unlike
/// any name that a user would choose.
bool is_temporary_name(std::string_view name);

class OutputFile {
 public:
  /// Opens a path for writing. Links are followed. Targets that are not regular files (devices, FIFOs), and targets of
  /// links in /proc, such as /dev/stdout, are written through and never replaced. A replaced file passes on its mode
  /// and, where possible, its owner. Throws Error naming the path for folders, read-only files and other targets that
  /// cannot be written.
  explicit OutputFile(const std::string& path, Staging staging = Staging::unnamed);
  /// Leaves the target unchanged unless commit() was called.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends bytes. Throws Error naming the path when the disk is full.
  void write(std::string_view bytes);
  /// Descriptor for other writers: open for reading and writing, always a seekable regular file.
  int fd() const { return staged_.get(); }

  /// Moves the written bytes to the target's place after syncing them to disk. Waits for a FIFO's reader. Throws Error
  /// naming the path, and Interrupted if a signal ends the wait.
  void commit();

 private:
  std::string staging_folder() const;
  void stage_unnamed();
  void stage_named();
  void write_through();
  void replace();

  std::string path_;                     // as given by the caller, for messages
  std::string target_;                   // with links followed, except those of /proc
  bool is_through_;                      // the target is written through
  std::optional<struct stat> replaced_;  // the file that commit() replaces
  std::string temporary_;                // the name of staged_, empty while it has none
  Descriptor staged_;
};

}  // namespace pictura
