// Output of commands: results on stdout, as one JSON object for machines, and a progress line with ETA on stderr.
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

/// Warns of each text, after `what`; of more than ten texts, prints ten and the number of the others.
void print_warnings(const std::string& what, const std::vector<std::string>& texts);

/// Text of a duration: "1 h 02 min", "3 min 05 s" or "12 s".
std::string format_duration(double seconds);

/// Text of a count: "1.20 M", "34.5 K" or "678".
std::string format_count(double value);

/// Progress line on stderr. On a terminal it is rewritten in place and cut off at the terminal's width; elsewhere it is
/// printed every ten seconds.
class ProgressLine {
 public:
  ~ProgressLine();
  void update(const std::string& text);
  /// Updates the text, followed by the estimated remaining time. `done` is the fraction of the work that was done since
  /// the line was created.
  void update(const std::string& text, double done);
  /// Prints the last text, which then remains.
  void finish();

 private:
  std::string text_;
  bool dirty_ = false;
  std::optional<Stopwatch> since_print_;
  Stopwatch since_start_;
};

/// Parses "AxB" with both numbers in [1, max]. Throws UsageError naming the option.
struct Pair {
  int first, second;
};
Pair parse_pair(const std::string& option, const std::string& text, int max);

/// Parses "4" (MSAA) or "4x4" (supersampling). Throws UsageError naming the option.
PixelSamples parse_samples(const std::string& option, const std::string& text);

}  // namespace pictura
