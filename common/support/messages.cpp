#include "pictura/common/support/messages.h"

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>

#include <fcntl.h>
#include <unistd.h>

#include "pictura/common/error.h"

namespace pictura {

void open_standard_streams() {
  for (const int stream : {STDIN_FILENO, STDOUT_FILENO, STDERR_FILENO}) {
    // open() returns the lowest free number, which is this stream's. Read-only, so that writing fails as on a closed
    // descriptor.
    if (::fcntl(stream, F_GETFD) < 0) ::open("/dev/null", O_RDONLY);
  }
  std::signal(SIGPIPE, SIG_IGN);
}

void print_result_text(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stdout); }
void print_message_text(const std::string& text) { std::fwrite(text.data(), 1, text.size(), stderr); }

void close_stdout() {
  // fclose() does not report bytes that an earlier call lost.
  errno = 0;
  const bool lost = std::ferror(stdout) != 0;
  const bool closed = std::fclose(stdout) == 0;
  PICTURA_CHECK(!lost && closed, "stdout: cannot be written{}{}", errno ? ": " : "", errno ? std::strerror(errno) : "");
}

std::string printable(std::string_view message) {
  std::string text;
  for (const char c : message) {
    constexpr unsigned char kFirstPrintable = 0x20, kDelete = 0x7F;
    const auto code = static_cast<unsigned char>(c);
    if (c == '\n')
      text += "\\n";
    else if (code < kFirstPrintable || code == kDelete)
      text += fmt::format("\\x{:02x}", code);
    else
      text += c;
  }
  return text;
}

}  // namespace pictura
