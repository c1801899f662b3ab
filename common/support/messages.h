// Printed output of programs: results on stdout, messages on stderr. Printing never throws. Lost output on stdout is an
// error when the program calls close_stdout(), after its work is saved. Lost messages on stderr are ignored.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pictura/common/error.h"

namespace pictura {

/// Opens /dev/null for each closed descriptor among 0, 1 and 2. Otherwise a file that is opened later could get that
/// number and receive printed output. Also ignores SIGPIPE, so that output to a pipe without a reader is a write error.
/// Call at the beginning of main().
void open_standard_streams();

/// These functions print a result on stdout, or a message on stderr.
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
/// Closes stdout. Throws Error if output was lost, for example because the disk is full.
void close_stdout();

/// Returns a message in one line, with control characters escaped: a line break becomes \n.
std::string printable(std::string_view message);

}  // namespace pictura
