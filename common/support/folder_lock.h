// One process at a time in a folder.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// A lock on a folder for as long as this object and its process live, however the process ends: it is on the file
/// `lock` there (flock), which stays and says who held it last. It binds those who ask for it.
class FolderLock {
 public:
  /// Throws Error naming the folder and the process that holds it.
  explicit FolderLock(const std::string& folder);
  ~FolderLock();
  FolderLock(const FolderLock&) = delete;
  FolderLock& operator=(const FolderLock&) = delete;

 private:
  int fd_;
};

}  // namespace pictura
