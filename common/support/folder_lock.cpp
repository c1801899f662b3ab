#include "pictura/common/support/folder_lock.h"

#include <cerrno>
#include <cstring>

#include <fcntl.h>
#include <sys/file.h>
#include <unistd.h>

#include "pictura/common/error.h"

namespace pictura {

namespace {

// Returns the text that the holder wrote; the file is empty for a moment after the lock is taken.
std::string holder_of(int fd) {
  char text[32] = {};
  const ssize_t size = ::pread(fd, text, sizeof text - 1, 0);
  return size > 0 ? fmt::format("process {}", text) : "another process";
}

}  // namespace

FolderLock::FolderLock(const std::string& folder)
    // Links are refused, because in a folder of unknown origin, a link could redirect this write to any file.
    : fd_(::open((folder + "/lock").c_str(), O_RDWR | O_CREAT | O_NOFOLLOW | O_CLOEXEC, 0666)) {
  PICTURA_CHECK(fd_ >= 0 || errno != ELOOP, "{}/lock: expected a file, got a link", folder);
  PICTURA_CHECK(fd_ >= 0, "{}/lock: cannot be opened: {}", folder, std::strerror(errno));
  try {
    if (::flock(fd_, LOCK_EX | LOCK_NB) != 0) {
      PICTURA_CHECK(errno != EWOULDBLOCK, "{}: in use by {}", folder, holder_of(fd_));
      fail("{}/lock: cannot be locked: {}", folder, std::strerror(errno));
    }
    const std::string id = fmt::format("{}", getpid());
    const bool written = ::ftruncate(fd_, 0) == 0 && ::pwrite(fd_, id.data(), id.size(), 0) == ssize_t(id.size());
    PICTURA_CHECK(written, "{}/lock: cannot be written: {}", folder, std::strerror(errno));
  } catch (...) {
    ::close(fd_);
    throw;
  }
}

FolderLock::~FolderLock() { ::close(fd_); }

}  // namespace pictura
