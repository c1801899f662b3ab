// What commands print: results on stdout, as one JSON object for machines; messages and a progress line with ETA on
// stderr, for people. Printing never throws: a stdout that takes nothing is an error after the work is saved
// (close_stdout()), a stderr that takes nothing loses messages.
#pragma once

#include <optional>
#include <string>
#include <utility>

#include <fmt/format.h>

#include "pictura/common/renderer.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/stopwatch.h"

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
/// Prints one object and a newline on stdout.
void print_json(const Json& object);

/// Ends stdout. Throws Error unless everything that was printed since the start was taken: a disk may be full.
void close_stdout();

/// A message in one line, in which control characters of names are escaped: "a\nb".
std::string printable(std::string_view message);

/// "1 h 02 min", "3 min 05 s" or "12 s".
std::string format_duration(double seconds);

/// "1.20 M", "34.5 K" or "678".
std::string format_count(double value);

/// One line on stderr, on a terminal rewritten in place and cut off at its width, elsewhere printed every ten seconds.
class ProgressLine {
 public:
  ~ProgressLine();
  void update(const std::string& text);
  /// With the time that is left, when `done` of the work has been done since this line was made.
  void update(const std::string& text, double done);
  /// Prints the last text once and for all.
  void finish();

 private:
  std::string text_;
  bool dirty_ = false;
  std::optional<Stopwatch> since_print_;
  const Stopwatch since_start_;
};

/// Parses "AxB" with both numbers in [1, max]. Throws UsageError naming the option.
struct Pair {
  int first, second;
};
Pair parse_pair(const std::string& option, const std::string& text, int max);

/// Parses "4" (MSAA) or "4x4" (supersampling). Throws UsageError naming the option.
PixelSamples parse_samples(const std::string& option, const std::string& text);

}  // namespace pictura
