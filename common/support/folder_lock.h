// Exclusive access to a folder for one process.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// A lock on a folder, held until this object is destroyed or the process ends for any reason. It locks the file `lock`
/// in the folder with flock; that file remains and records the last holder. The lock is advisory.
class FolderLock {
 public:
  /// Throws Error naming the folder and, if another process holds the lock, that process.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace pictura
