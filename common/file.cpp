#include "pictura/common/file.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <fstream>

#include <fcntl.h>
#include <unistd.h>

#include "pictura/common/error.h"

namespace pictura {

namespace fs = std::filesystem;

std::string read_file(const std::string& path, std::size_t max_bytes) {
  std::error_code code;
  const fs::file_status status = fs::status(path, code);
  PICTURA_CHECK(fs::exists(status), "{}: no such file", path);
  PICTURA_CHECK(!fs::is_directory(status), "{}: expected a file, got a folder", path);
  std::ifstream in(path, std::ios::binary);
  PICTURA_CHECK(in, "{}: cannot be opened: {}", path, std::strerror(errno));
  std::string bytes;
  char buffer[1 << 16];
  while (in.read(buffer, sizeof buffer) || in.gcount() > 0) {
    bytes.append(buffer, static_cast<std::size_t>(in.gcount()));
    PICTURA_CHECK(bytes.size() <= max_bytes, "{}: larger than {} bytes", path, max_bytes);
  }
  PICTURA_CHECK(!in.bad(), "{}: reading failed: {}", path, std::strerror(errno));
  return bytes;
}

void write_renamed(const std::string& path, const std::function<void(const std::string&)>& write) {
  // The ending stays, for writers that choose a format by it.
  const fs::path target(path);
  const std::string temporary = (target.parent_path() / fmt::format(".{}.{}.tmp{}", target.stem().string(), getpid(),
                                                                    target.extension().string()))
                                    .string();
  try {
    write(temporary);
    // On disk before the rename, so that a crash never leaves an empty file under the final name.
    const int fd = ::open(temporary.c_str(), O_RDONLY | O_CLOEXEC);
    PICTURA_CHECK(fd >= 0, "{}: cannot be written: {}", path, std::strerror(errno));
    const bool synced = ::fsync(fd) == 0;
    ::close(fd);
    PICTURA_CHECK(synced, "{}: cannot be written: {}", path, std::strerror(errno));
    PICTURA_CHECK(std::rename(temporary.c_str(), path.c_str()) == 0, "{}: cannot be replaced: {}", path,
                  std::strerror(errno));
  } catch (...) {
    std::error_code ignored;
    fs::remove(temporary, ignored);
    throw;
  }
}

void write_file(const std::string& path, std::string_view bytes) {
  write_renamed(path, [&](const std::string& temporary) {
    std::ofstream out(temporary, std::ios::binary);
    out.write(bytes.data(), static_cast<std::streamsize>(bytes.size()));
    out.close();
    PICTURA_CHECK(out, "{}: cannot be written: {}", path, std::strerror(errno));
  });
}

void make_output_folder(const std::string& path) {
  std::error_code code;
  fs::create_directories(path, code);
  PICTURA_CHECK(fs::is_directory(path), "{}: cannot be made: {}", path, code ? code.message() : "it is a file");
  // Ask by trying: permission bits say nothing of read-only mounts, and a superuser passes access().
  const std::string probe = (fs::path(path) / fmt::format(".probe.{}", getpid())).string();
  {
    std::ofstream out(probe);
    PICTURA_CHECK(out, "{}: cannot be written to: {}", path, std::strerror(errno));
  }
  fs::remove(probe, code);
}

}  // namespace pictura
