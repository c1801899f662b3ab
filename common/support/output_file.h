// The one writer of output files. Bytes go into a file without a name, and only a whole file gets one: a reader never
// sees half a file, a full disk leaves the old one, and a process that is killed leaves nothing behind.
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

/// Where bytes wait for commit(). Without a name wherever the file system can; else, and for tests, in a hidden file
/// beside the target, which the next writer into that folder removes if its own writer was killed.
enum class Staging { unnamed, named };

/// Whether a file of this name is such a hidden one: .pictura-*.tmp with 16 random hexadecimal digits, as no file of a
/// user's is called.
bool is_temporary_name(std::string_view name);

class OutputFile {
 public:
  /// Links are followed. What is no regular file (a device, a FIFO), and what a link of /proc leads to, as /dev/stdout,
  /// is written through and never replaced. A file that is replaced passes on its mode and, where possible, its owner.
  /// Throws Error naming the path for folders and read-only files, and where nothing can be written.
  explicit OutputFile(const std::string& path, Staging staging = Staging::unnamed);
  /// Without commit(), the target is as it was before.
  ~OutputFile();
  OutputFile(const OutputFile&) = delete;
  OutputFile& operator=(const OutputFile&) = delete;

  /// Appends. Throws Error naming the path when the disk is full.
  void write(std::string_view bytes);
  /// For other writers: open for reading and writing, always a regular file that can be sought in.
  int fd() const { return staged_.get(); }

  /// Puts what was written in the target's place, on disk before. Waits for a FIFO's reader. Throws Error naming the
  /// path, Interrupted while it waits.
  void commit();

 private:
  std::string staging_folder() const;
  void stage_unnamed();
  void stage_named();
  void pour();
  void replace();

  std::string path_;                     // as the caller says it, for messages
  std::string target_;                   // with links followed, except those of /proc
  bool is_through_;                      // the target is written through
  std::optional<struct stat> replaced_;  // the file that commit() replaces
  std::string temporary_;                // the name of staged_, empty while it has none
  Descriptor staged_;
};

}  // namespace pictura
