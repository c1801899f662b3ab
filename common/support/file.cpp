#include "pictura/common/support/file.h"

#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>

#include <fcntl.h>
#include <poll.h>
#include <sys/stat.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/output_file.h"
#include "pictura/common/support/regular_file.h"

namespace pictura {

namespace fs = std::filesystem;

namespace {

bool is_same_version(const struct stat& a, const struct stat& b) {
  return a.st_size == b.st_size && a.st_mtim.tv_sec == b.st_mtim.tv_sec && a.st_mtim.tv_nsec == b.st_mtim.tv_nsec;
}

constexpr std::size_t kChunk_bytes = std::size_t{1} << 16;

/// A file that is open for reading. Opening a FIFO does not wait for its writer. Reading it waits, and can be
/// interrupted.
class InputFile {
 public:
  explicit InputFile(const std::string& path)
      : path_(path), file_(::open(path.c_str(), O_RDONLY | O_NONBLOCK | O_NOCTTY | O_CLOEXEC)) {
    PICTURA_CHECK(!path.empty(), "expected the name of a file to read, got an empty one");
    PICTURA_CHECK(file_.get() >= 0 || errno != ENOENT, "{}: no such file", path_);
    PICTURA_CHECK(file_.get() >= 0, "{}: cannot be opened: {}", path_, std::strerror(errno));
    opened_ = status();
    PICTURA_CHECK(!S_ISDIR(opened_.st_mode), "{}: expected a file, got a folder", path_);
  }

  /// Whether the size of the file is known in advance; it is unknown for pipes and similar files.
  bool is_regular() const { return S_ISREG(opened_.st_mode); }
  std::size_t size_bytes() const { return static_cast<std::size_t>(opened_.st_size); }

  /// Throws Error unless the bytes read are the whole file and the file is unchanged since it was opened.
  void check_unchanged(std::size_t bytes_read) const {
    if (!is_regular()) return;
    // The kernel's own files report size 0 but contain bytes.
    const bool is_whole = opened_.st_size == 0 || bytes_read == size_bytes();
    PICTURA_CHECK(is_whole && is_same_version(opened_, status()), "{}: changed while it was read", path_);
  }

  /// Appends the next bytes, at most `count`; returns their number, 0 at the end.
  std::size_t append_to(std::string* bytes, std::size_t count) const {
    const std::size_t before = bytes->size();
    bytes->resize(before + count);
    ssize_t got = 0;
    do {
      wait_for_bytes();
      got = ::read(file_.get(), bytes->data() + before, count);
    } while (got < 0 && (errno == EINTR || errno == EAGAIN));
    PICTURA_CHECK(got >= 0, "{}: reading failed: {}", path_, std::strerror(errno));
    bytes->resize(before + static_cast<std::size_t>(got));
    return static_cast<std::size_t>(got);
  }

 private:
  struct stat status() const {
    struct stat result{};
    PICTURA_CHECK(::fstat(file_.get(), &result) == 0, "{}: its size cannot be read: {}", path_, std::strerror(errno));
    return result;
  }

  // Waits until there are bytes or no writer is left. For regular files, returns immediately.
  void wait_for_bytes() const {
    constexpr int kPoll_ms = 100;
    pollfd slot{.fd = file_.get(), .events = POLLIN, .revents = 0};
    while (::poll(&slot, 1, kPoll_ms) <= 0) {
      if (interrupted()) throw Interrupted(fmt::format("{}: interrupted while it was read", path_));
    }
  }

  const std::string& path_;
  Descriptor file_;
  struct stat opened_{};
};

}  // namespace

std::string read_file(const std::string& path, std::size_t max_bytes,
                      const std::function<void(std::string_view first)>& check) {
  const InputFile file(path);
  const auto check_size = [&](std::size_t bytes) {
    PICTURA_CHECK(bytes <= max_bytes, "{}: larger than {} bytes", path, max_bytes);
  };
  std::string bytes;
  if (file.is_regular()) {
    check_size(file.size_bytes());
    bytes.reserve(file.size_bytes() + kChunk_bytes);
  }
  while (bytes.size() < kPrefix_bytes && file.append_to(&bytes, kChunk_bytes) > 0) check_size(bytes.size());
  if (check) check(std::string_view(bytes).substr(0, kPrefix_bytes));
  while (file.append_to(&bytes, kChunk_bytes) > 0) check_size(bytes.size());
  file.check_unchanged(bytes.size());
  return bytes;
}

std::string hash_of_file(const std::string& path) {
  const InputFile file(path);
  Hash64 hash;
  std::size_t bytes_read = 0;
  for (std::string chunk; file.append_to(&chunk, kChunk_bytes) > 0; chunk.clear()) {
    throw_if_interrupted();
    hash.add_bytes(chunk.data(), chunk.size());
    bytes_read += chunk.size();
  }
  file.check_unchanged(bytes_read);
  return hash.hex();
}

void write_file(const std::string& path, std::string_view bytes) {
  OutputFile out(path);
  out.write(bytes);
  out.commit();
}

std::string cache_folder(const std::string& name) {
  auto variable = [](const char* variable_name) -> std::string {
    const char* value = std::getenv(variable_name);
    return value ? value : "";
  };
  if (variable("PICTURA_CACHE") == "off") return "";
  std::string folder = variable("XDG_CACHE_HOME");
  if (folder.empty()) {
    const std::string home = variable("HOME");
    if (home.empty()) return "";
    folder = home + "/.cache";
  }
  return folder + "/pictura/" + name;
}

std::optional<std::string> read_cached(const std::string& path) {
  std::error_code error;
  if (!fs::exists(path, error)) return std::nullopt;
  require_regular_file(path);
  return read_file(path);
}

void write_to_cache(const std::string& path, std::string_view bytes) {
  std::error_code error;
  if (fs::exists(path, error) && !fs::is_regular_file(path, error)) return;
  try {
    make_output_folder(fs::path(path).parent_path().string());
    write_file(path, bytes);
  } catch (const Error&) {
  }
}

void make_output_folder(const std::string& path) {
  PICTURA_CHECK(!path.empty(), "expected the name of a folder to write into, got an empty one");
  std::error_code making, asking;
  fs::create_directories(path, making);
  const bool is_folder = fs::is_directory(path, asking);
  PICTURA_CHECK(is_folder, "{}: cannot be created: {}", path,
                making   ? making.message()
                : asking ? asking.message()
                         : "it is a file");
  // Tests by writing a file, because permission bits do not show read-only mounts, and access() succeeds for a
  // superuser.
  try {
    const OutputFile probe((fs::path(path) / ".probe").string());
  } catch (const Error& error) {
    fail("{}: cannot be written to: {}", path, error.what());
  }
}

}  // namespace pictura
