#include "pictura/common/support/output_file.h"

#include <cerrno>
#include <climits>
#include <cstdio>
#include <cstring>
#include <filesystem>
#include <random>

#include <fcntl.h>
#include <linux/magic.h>
#include <poll.h>
#include <sys/file.h>
#include <sys/stat.h>
#include <sys/vfs.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/numbers.h"

namespace pictura {

namespace fs = std::filesystem;

namespace {

constexpr int kPoll_ms = 100;

[[noreturn]] void fail_to_write(const std::string& path) {
  fail("{}: cannot be written: {}", path, std::strerror(errno));
}

std::string folder_of(const std::string& path) {
  const std::string folder = fs::path(path).parent_path().string();
  return folder.empty() ? "." : folder;
}

// Whether the folder is in /proc, where the kernel makes the links. Such a link refers to an open file, which may not
// have the name that the link contains.
bool is_in_proc(const std::string& folder) {
  struct statfs status{};
  return ::statfs(folder.c_str(), &status) == 0 && status.f_type == PROC_SUPER_MAGIC;
}

// Returns the path at the end of a chain of links, existing or not, or the first path within /proc.
std::string without_links(const std::string& path) {
  constexpr int kMaxLinks = 40;
  fs::path target(path);
  std::error_code error;
  for (int i = 0; !is_in_proc(folder_of(target)) && fs::is_symlink(target, error); ++i) {
    PICTURA_CHECK(i < kMaxLinks, "{}: cannot be written: {}", path, std::strerror(ELOOP));
    const fs::path next = fs::read_symlink(target, error);
    PICTURA_CHECK(!error, "{}: cannot be written: {}", path, error.message());
    target = next.is_absolute() ? next : target.parent_path() / next;
  }
  return target.string();
}

// Returns the descriptor of this process that a path without links refers to: 3 for /proc/self/fd/3.
std::optional<int> descriptor_named(const std::string& target) {
  const std::optional<uint64_t> number = parse_unsigned(fs::path(target).filename().string());
  std::error_code error;
  if (!number || *number > uint64_t{INT_MAX} || !fs::equivalent(folder_of(target), "/proc/self/fd", error)) return {};
  return static_cast<int>(*number);
}

constexpr std::string_view kHiddenBeginning = ".pictura-", kHiddenEnding = ".tmp";
constexpr size_t kHiddenDigits = 16;

// Returns a random name for a hidden file in the folder. The caller must create the file as a new file (O_EXCL,
// linkat).
std::string new_hidden_name(const std::string& folder) {
  std::random_device random;
  return fmt::format("{}/{}{:08x}{:08x}{}", folder, kHiddenBeginning, random(), random(), kHiddenEnding);
}

// Removes those hidden files of the folder whose writers have ended. A writer locks its file until the writer's process
// ends.
void remove_abandoned(const std::string& folder) {
  std::error_code error;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
    if (!is_temporary_name(entry.path().filename().string())) continue;
    const std::string name = entry.path().string();
    const Descriptor file(::open(name.c_str(), O_RDONLY | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC));
    if (file.get() >= 0 && ::flock(file.get(), LOCK_EX | LOCK_NB) == 0) ::unlink(name.c_str());
  }
}

void write_all(int fd, std::string_view bytes, const std::string& path) {
  while (!bytes.empty()) {
    const ssize_t count = ::write(fd, bytes.data(), bytes.size());
    if (count > 0) {
      bytes.remove_prefix(static_cast<std::size_t>(count));
    } else if (count < 0 && errno == EAGAIN) {
      pollfd slot{.fd = fd, .events = POLLOUT, .revents = 0};
      ::poll(&slot, 1, kPoll_ms);
      if (interrupted()) throw Interrupted(fmt::format("{}: interrupted while it was written", path));
    } else if (count == 0 || errno != EINTR) {
      fail_to_write(path);
    }
  }
}

// Opens a target that is written into and not replaced. If the target is a descriptor of this process, the descriptor
// keeps its position. Waits for a FIFO's reader, because a user may start the reader later.
int open_through(const std::string& target, const std::string& path) {
  if (const std::optional<int> own = descriptor_named(target)) {
    const int fd = ::fcntl(*own, F_DUPFD_CLOEXEC, 0);
    if (fd < 0) fail_to_write(path);
    return fd;
  }
  for (;;) {
    const int fd = ::open(target.c_str(), O_WRONLY | O_APPEND | O_NONBLOCK | O_NOCTTY | O_CLOEXEC);
    if (fd >= 0) return fd;
    if (errno != ENXIO && errno != EINTR) fail_to_write(path);
    if (interrupted()) throw Interrupted(fmt::format("{}: interrupted while it waited for a reader", path));
    ::poll(nullptr, 0, kPoll_ms);
  }
}

}  // namespace

bool is_temporary_name(std::string_view name) {
  if (name.size() != kHiddenBeginning.size() + kHiddenDigits + kHiddenEnding.size()) return false;
  const std::string_view digits = name.substr(kHiddenBeginning.size(), kHiddenDigits);
  return name.starts_with(kHiddenBeginning) && name.ends_with(kHiddenEnding) &&
         digits.find_first_not_of("0123456789abcdef") == std::string_view::npos;
}

void Descriptor::reset(int fd) {
  if (fd_ >= 0) ::close(fd_);
  fd_ = fd;
}

OutputFile::OutputFile(const std::string& path, Staging staging) : path_(path) {
  PICTURA_CHECK(!path.empty(), "expected the name of a file to write, got an empty one");
  // A system call would read the name only up to the zero byte.
  PICTURA_CHECK(path.find('\0') == std::string::npos, "{}: expected the name of a file, got a name with a zero byte",
                path.substr(0, path.find('\0')));
  struct stat status{};
  const bool exists = ::stat(path.c_str(), &status) == 0;
  PICTURA_CHECK(!exists || !S_ISDIR(status.st_mode), "{}: cannot be written: expected a file, got a folder", path);
  target_ = without_links(path);
  is_through_ = exists && (!S_ISREG(status.st_mode) || is_in_proc(folder_of(target_)));
  if (exists && !is_through_) {
    // faccessat() succeeds for a superuser, so mode bits are checked too.
    const bool is_read_only = (status.st_mode & (S_IWUSR | S_IWGRP | S_IWOTH)) == 0 ||
                              ::faccessat(AT_FDCWD, target_.c_str(), W_OK, AT_EACCESS) != 0;
    PICTURA_CHECK(!is_read_only, "{}: cannot be written: it is read-only", path);
    replaced_ = status;
  }
  remove_abandoned(staging_folder());
  if (staging == Staging::unnamed) stage_unnamed();
  if (staged_.get() < 0) stage_named();
}

OutputFile::~OutputFile() {
  if (!temporary_.empty()) ::unlink(temporary_.c_str());
}

// Bytes for a device are staged in the folder for temporary files, because files cannot be created next to a device.
std::string OutputFile::staging_folder() const {
  if (!is_through_) return folder_of(target_);
  std::error_code error;
  const std::string folder = fs::temp_directory_path(error).string();
  PICTURA_CHECK(!error, "{}: cannot be written: expected $TMPDIR to name a folder for temporary files: {}", path_,
                error.message());
  return folder;
}

void OutputFile::stage_unnamed() {
#ifdef O_TMPFILE
  constexpr const char* kNames = "/proc/self/fd";  // replace() finds the file again by a path in this folder
  if (::access(kNames, X_OK) != 0) return;
  staged_.reset(::open(staging_folder().c_str(), O_TMPFILE | O_RDWR | O_CLOEXEC, 0666));
  if (staged_.get() >= 0) ::flock(staged_.get(), LOCK_EX | LOCK_NB);
#endif
}

void OutputFile::stage_named() {
  while (staged_.get() < 0) {
    const std::string name = new_hidden_name(staging_folder());
    const Descriptor file(::open(name.c_str(), O_RDWR | O_CREAT | O_EXCL | O_CLOEXEC, 0666));
    if (file.get() < 0 && errno == EEXIST) continue;
    if (file.get() < 0) fail_to_write(path_);
    // Another writer may have removed the file as abandoned before it was locked.
    ::flock(file.get(), LOCK_EX | LOCK_NB);
    struct stat status{};
    if (::fstat(file.get(), &status) != 0 || status.st_nlink == 0) continue;
    staged_.reset(::fcntl(file.get(), F_DUPFD_CLOEXEC, 0));
    if (staged_.get() < 0) fail_to_write(path_);
    temporary_ = name;
  }
}

void OutputFile::write(std::string_view bytes) { write_all(staged_.get(), bytes, path_); }

void OutputFile::commit() { is_through_ ? write_through() : replace(); }

void OutputFile::write_through() {
  const Descriptor through(open_through(target_, path_));
  std::string chunk(std::size_t{1} << 16, '\0');
  for (off_t offset = 0;;) {
    const ssize_t count = ::pread(staged_.get(), chunk.data(), chunk.size(), offset);
    if (count < 0) fail_to_write(path_);
    if (count == 0) return;
    write_all(through.get(), std::string_view(chunk).substr(0, static_cast<std::size_t>(count)), path_);
    offset += count;
  }
}

void OutputFile::replace() {
  if (replaced_) {
    // Only a superuser can set the owner, and only a member of a group can set the group. Failure is ignored.
    [[maybe_unused]] const int ignored = ::fchown(staged_.get(), replaced_->st_uid, replaced_->st_gid);
    constexpr mode_t kPermissions = S_IRWXU | S_IRWXG | S_IRWXO;
    struct stat staged{};
    if (::fstat(staged_.get(), &staged) != 0) fail_to_write(path_);
    // File systems without modes, where all modes are equal, refuse the call.
    const bool differs = ((staged.st_mode ^ replaced_->st_mode) & kPermissions) != 0;
    if (differs && ::fchmod(staged_.get(), replaced_->st_mode & kPermissions) != 0) fail_to_write(path_);
  }
  // Synced before the rename, so that a crash never leaves an empty file under the final name.
  if (::fsync(staged_.get()) != 0) fail_to_write(path_);
  if (temporary_.empty()) {
    // linkat() cannot replace an existing name, and rename() cannot move a file without a name. So the file first gets
    // a hidden name and then the final name.
    const std::string unnamed = fmt::format("/proc/self/fd/{}", staged_.get());
    while (temporary_.empty()) {
      const std::string name = new_hidden_name(folder_of(target_));
      if (::linkat(AT_FDCWD, unnamed.c_str(), AT_FDCWD, name.c_str(), AT_SYMLINK_FOLLOW) == 0) {
        temporary_ = name;
      } else if (errno != EEXIST) {
        fail_to_write(path_);
      }
    }
  }
  if (std::rename(temporary_.c_str(), target_.c_str()) != 0) {
    fail("{}: cannot be replaced: {}", path_, std::strerror(errno));
  }
  temporary_.clear();
}

}  // namespace pictura
