#include "pictura/common/support/filled_folder.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <utility>

#include <fcntl.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"

namespace pictura {

namespace fs = std::filesystem;

namespace {

// Terminator of each name in a list; file names cannot contain it.
constexpr char kEnd = '\0';

// Whether a name is a plain file name. In a folder of unknown origin, the list may contain names that lead out of the
// folder.
bool is_plain(const std::string& name) { return !name.empty() && fs::path(name).filename() == name; }

std::string list_of(const std::string& folder, const std::string& kind) {
  return (fs::path(folder) / (".pictura-" + kind)).string();
}

}  // namespace

std::set<std::string> filled_files(const std::string& folder, const std::string& kind) {
  const std::string list = list_of(folder, kind);
  std::set<std::string> names;
  if (!fs::exists(list)) return names;
  const std::string text = read_file(list);
  for (size_t begin = 0, end; (end = text.find(kEnd, begin)) != std::string::npos; begin = end + 1) {
    names.insert(text.substr(begin, end - begin));
  }
  return names;
}

FilledFolder::FilledFolder(std::string folder, const std::string& kind)
    : folder_(std::move(folder)), list_(list_of(folder_, kind)) {
  make_output_folder(folder_);
  list_file_.reset(::open(list_.c_str(), O_WRONLY | O_APPEND | O_CREAT | O_NOFOLLOW | O_NONBLOCK | O_CLOEXEC, 0666));
  PICTURA_CHECK(list_file_.get() >= 0, "{}: cannot be opened: {}", list_, std::strerror(errno));
  listed_ = filled_files(folder_, kind);
}

std::string FilledFolder::file(const std::string& name) {
  std::string path = (fs::path(folder_) / name).string();
  std::error_code ignored;
  PICTURA_CHECK(!fs::is_symlink(path, ignored), "{}: expected a file or nothing, got a link", path);
  written_.insert(name);
  if (!listed_.insert(name).second) return path;
  // The name is listed before the file exists, so that the next call finds it even if the process ends before or during
  // the writing.
  const std::string line = name + kEnd;
  const bool is_listed = ::write(list_file_.get(), line.data(), line.size()) == static_cast<ssize_t>(line.size());
  PICTURA_CHECK(is_listed, "{}: cannot be written: {}", list_, std::strerror(errno));
  return path;
}

void FilledFolder::remove_others() {
  std::string lines;
  for (const std::string& name : written_) (lines += name) += kEnd;
  for (const std::string& name : listed_) {
    const fs::path path = fs::path(folder_) / name;
    std::error_code ignored;
    const bool is_file = is_plain(name) && fs::symlink_status(path, ignored).type() == fs::file_type::regular;
    if (is_file && !written_.contains(name)) fs::remove(path, ignored);
  }
  write_file(list_, lines);
}

}  // namespace pictura
