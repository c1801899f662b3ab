#include "pictura/cli/draw_chart.h"

#include <cerrno>
#include <charconv>
#include <csignal>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <string>

#include <fcntl.h>
#include <fmt/format.h>
#include <poll.h>
#include <spawn.h>
#include <sys/mman.h>
#include <sys/wait.h>
#include <unistd.h>

#include "pictura/cli/chart_source.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/json_text.h"
#include "pictura/common/support/output_file.h"

extern char** environ;

namespace pictura {

namespace {

constexpr int kStatusWithoutMatplotlib = 3;  // exit status of plot.py

std::string python_for_charts() {
  if (const char* const chosen = std::getenv("PICTURA_PYTHON"); chosen && *chosen) return chosen;
  const std::string built_with = PICTURA_CHART_PYTHON;
  return !built_with.empty() && ::access(built_with.c_str(), X_OK) == 0 ? built_with : "python3";
}

/// Opens an unnamed file with the text of plot.py, positioned at its beginning.
void open_source(Descriptor* source_out) {
  const std::string_view text = chart_source::plot_py();
  source_out->reset(::memfd_create("plot.py", MFD_CLOEXEC));
  const bool is_written = source_out->get() >= 0 &&
                          ::write(source_out->get(), text.data(), text.size()) == static_cast<ssize_t>(text.size());
  PICTURA_CHECK(is_written && ::lseek(source_out->get(), 0, SEEK_SET) == 0,
                "charts: cannot allocate memory for plot.py: {}", std::strerror(errno));
}

/// Python process that runs plot.py. The destructor ends the process.
class Plotter {
 public:
  Plotter(const std::string& python, std::string request) {
    Descriptor source;
    open_source(&source);
    int ends[2];
    PICTURA_CHECK(::pipe2(ends, O_CLOEXEC) == 0, "charts: cannot open a pipe for {}: {}", python, std::strerror(errno));
    messages_.reset(ends[0]);
    const Descriptor child_end(ends[1]);

    std::fflush(stdout);
    posix_spawn_file_actions_t actions;
    posix_spawn_file_actions_init(&actions);
    posix_spawn_file_actions_adddup2(&actions, source.get(), STDIN_FILENO);
    posix_spawn_file_actions_adddup2(&actions, child_end.get(), STDERR_FILENO);
    // The child runs in its own process group, so that only this process receives ^C in a terminal.
    posix_spawnattr_t attributes;
    posix_spawnattr_init(&attributes);
    posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP);
    posix_spawnattr_setpgroup(&attributes, 0);
    std::string name = python, script = "-", safe_path = "PYTHONSAFEPATH=1";
    char* const arguments[] = {name.data(), script.data(), request.data(), nullptr};
    // The first variable excludes the working directory from the module search path.
    std::vector<char*> environment{safe_path.data()};
    for (char** variable = environ; *variable; ++variable) environment.push_back(*variable);
    environment.push_back(nullptr);
    const int code = ::posix_spawnp(&child_, arguments[0], &actions, &attributes, arguments, environment.data());
    posix_spawn_file_actions_destroy(&actions);
    posix_spawnattr_destroy(&attributes);
    if (code != 0) {
      child_ = -1;
      throw NoMatplotlib(fmt::format(
          "charts need Python 3.11 with Matplotlib (PICTURA_PYTHON gives its path): {} cannot be started: {}", python,
          std::strerror(code)));
    }
  }
  ~Plotter() {
    if (child_ < 0) return;
    ::kill(child_, SIGTERM);
    reap();
  }
  Plotter(const Plotter&) = delete;
  Plotter& operator=(const Plotter&) = delete;

  /// Reads the process's stderr until its end, and returns the text. Throws Interrupted.
  std::string read_messages() {
    std::string messages;
    char buffer[4096];
    for (;;) {
      work_.check();
      pollfd ready{messages_.get(), POLLIN, 0};
      if (::poll(&ready, 1, 100) <= 0) continue;
      const ssize_t length = ::read(messages_.get(), buffer, sizeof buffer);
      if (length > 0) messages.append(buffer, static_cast<size_t>(length));
      if (length == 0) return messages;
    }
  }

  int reap() {
    int status = 0;
    while (::waitpid(child_, &status, 0) < 0 && errno == EINTR) continue;
    child_ = -1;
    return status;
  }

 private:
  const InterruptibleWork work_{"interrupted while a chart was drawn"};  // created before the child starts
  pid_t child_ = -1;
  Descriptor messages_;
};

/// Returns the last line of Python's stderr output, without "error: ".
std::string message_in(std::string messages) {
  while (messages.ends_with('\n')) messages.pop_back();
  const size_t line = messages.rfind('\n');
  if (line != std::string::npos) messages.erase(0, line + 1);
  constexpr std::string_view kHead = "error: ";
  return messages.starts_with(kHead) ? messages.substr(kHead.size()) : messages;
}

}  // namespace

void draw_chart(const Json& request) {
  const std::string python = python_for_charts();
  Plotter plotter(python, json_text(request));
  const std::string message = message_in(plotter.read_messages());
  const int status = plotter.reap();
  PICTURA_CHECK(WIFEXITED(status), "charts: {} was ended by signal {}", python, WTERMSIG(status));
  if (WEXITSTATUS(status) == kStatusWithoutMatplotlib) throw NoMatplotlib(message);
  PICTURA_CHECK(
      WEXITSTATUS(status) == 0, "{}",
      message.empty() ? fmt::format("charts: {} ended with status {}", python, WEXITSTATUS(status)) : message);
}

std::vector<Rgb> chart_colors(std::string_view name) {
  const std::string_view text = chart_source::plot_py();
  const size_t begin = text.find(fmt::format("\n{} = (", name));
  PICTURA_CHECK(begin != text.npos, "plot.py: expected colours {}", name);
  std::string_view list = text.substr(begin, text.find(')', begin) - begin);
  std::vector<Rgb> colors;
  for (size_t at = list.find('#'); at != list.npos; at = list.find('#', at + 1)) {
    uint32_t rgb = 0;
    std::from_chars(list.data() + at + 1, list.data() + at + 7, rgb, 16);
    colors.push_back(rgb8(rgb >> 16, rgb >> 8 & 0xFF, rgb & 0xFF));
  }
  return colors;
}

}  // namespace pictura
