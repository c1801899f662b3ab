// Exclusive access to a folder.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// An advisory lock on a folder, held until this object is destroyed or the process ends. The locked file `lock`
/// remains and records the last holder.
class FolderLock {
 public:
  /// Throws Error if the lock cannot be taken. The message names the folder and, if known, the process that holds the
  /// lock.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace pictura
