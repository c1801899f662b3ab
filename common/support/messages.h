// Output of programs for people: results on stdout, messages on stderr. Printing never throws. A failing stdout is an
// error after the work is saved (close_stdout()); a failing stderr loses messages.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pictura/common/error.h"

namespace pictura {

/// Opens /dev/null on those of descriptors 0 to 2 that are closed, so that no file opened later gets their numbers and
/// receives printed output. Also ignores SIGPIPE: a reader that has ended becomes a write error. Call at the beginning
/// of main().
void open_standard_streams();

/// Print on stdout and on stderr.
void print_result_text(const std::string& text);
void print_message_text(const std::string& text);
template <typename... T>
void print_result(fmt::format_string<T...> format, T&&... values) {
  print_result_text(fmt::format(format, std::forward<T>(values)...));
}
template <typename... T>
void print_message(fmt::format_string<T...> format, T&&... values) {
  print_message_text(fmt::format(format, std::forward<T>(values)...));
}
/// Closes stdout. Throws Error unless all output since the start was written; the disk may be full.
void close_stdout();

/// Returns a message in one line, with control characters of names escaped: "a\nb".
std::string printable(std::string_view message);

}  // namespace pictura
