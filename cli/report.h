// What commands print: one JSON object on stdout for machines, a progress line with ETA on stderr for people.
#pragma once

#include <chrono>
#include <string>

#include "pictura/common/renderer.h"
#include "pictura/common/support/json.h"

namespace pictura {

/// Prints one object and a newline on stdout. close_stdout() says whether all of it was taken.
void print_json(const Json& object);

/// Ends stdout. Throws Error unless everything that was printed since the start was taken: a disk may be full.
void close_stdout();

/// A message in one line, in which control characters of names are escaped: "a\nb".
std::string printable(std::string_view message);

/// Until now.
double seconds_since(std::chrono::steady_clock::time_point begin);

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
  std::chrono::steady_clock::time_point last_print_{}, begin_ = std::chrono::steady_clock::now();
};

/// Parses "AxB" with both numbers in [1, max]. Throws UsageError naming the option.
struct Pair {
  int first, second;
};
Pair parse_pair(const std::string& option, const std::string& text, int max);

/// Parses "4" (MSAA) or "4x4" (supersampling). Throws UsageError naming the option.
PixelSamples parse_samples(const std::string& option, const std::string& text);

}  // namespace pictura
