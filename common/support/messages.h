// What programs print: results on stdout, messages on stderr, for people. Printing never throws: a stdout that takes
// nothing is an error after the work is saved (close_stdout()), a stderr that takes nothing loses messages.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pictura/common/error.h"

namespace pictura {

/// Opens /dev/null on those of descriptors 0 to 2 that are closed, so that no file that is opened later gets their
/// number and what is printed. From now on a reader that has ended is an error of writing instead of a sudden death
/// (SIGPIPE). For the beginning of main().
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
/// Ends stdout. Throws Error unless everything that was printed since the start was taken: a disk may be full.
void close_stdout();

/// A message in one line, in which control characters of names are escaped: "a\nb".
std::string printable(std::string_view message);

}  // namespace pictura
