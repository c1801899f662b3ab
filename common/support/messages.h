// Printed output: results on stdout, messages on stderr. Printing never throws.
#pragma once

#include <string>
#include <string_view>
#include <utility>

#include <fmt/format.h>

#include "pictura/common/error.h"

namespace pictura {

/// Opens /dev/null for closed descriptors among 0, 1 and 2. Ignores SIGPIPE. Call it at the beginning of main().
void open_standard_streams();

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
/// Closes stdout. Throws Error if output was lost.
void close_stdout();

/// Returns a message in one line, with escaped control characters.
std::string printable(std::string_view message);

}  // namespace pictura
