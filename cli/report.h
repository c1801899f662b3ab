// Output of commands: results on stdout, which may be one JSON object, and a progress line with the remaining time on
// stderr.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/messages.h"
#include "pictura/common/support/stopwatch.h"

namespace pictura {

/// Prints one object and a newline to stdout.
void print_json(const Json& object);

/// Prints a warning "what: text" for each text. If there are more than ten texts, prints ten of them and the number of
/// the others.
void print_warnings(const std::string& what, const std::vector<std::string>& texts);

/// Returns the text of a duration, such as "1 h 02 min", "3 min 05 s" or "12 s".
std::string format_duration(double seconds);

/// Returns the text of a count, such as "1.20 M", "34.5 K" or "678".
std::string format_count(double value);

/// Progress line on stderr. On a terminal it is rewritten in place, and cut off at the width of the terminal. Elsewhere
/// it is printed every ten seconds.
class ProgressLine {
 public:
  ~ProgressLine();
  void update(const std::string& text);
  /// Updates the text, and appends the estimated remaining time. `done` is the completed fraction of the work since the
  /// line was created.
  void update(const std::string& text, double done);
  /// Prints the last text so that it remains visible.
  void finish();

 private:
  std::string text_;
  bool dirty_ = false;
  std::optional<Stopwatch> since_print_;
  Stopwatch since_start_;
};

/// Pair of numbers, written as "AxB".
struct Pair {
  int first, second;
};
/// Parses "AxB" with both numbers in [1, max]. Throws UsageError, which names the option, for other texts.
Pair parse_pair(const std::string& option, const std::string& text, int max);

/// Parses "4" (MSAA) or "4x4" (supersampling). Throws UsageError, which names the option, for other texts.
PixelSamples parse_samples(const std::string& option, const std::string& text);

}  // namespace pictura
