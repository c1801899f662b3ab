// Output of commands: results on stdout, and a progress line on stderr.
#pragma once

#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/messages.h"
#include "pictura/common/support/stopwatch.h"

namespace pictura {

void print_json(const Json& object);

/// Prints "what: text" for up to ten texts, and the number of others.
void print_warnings(const std::string& what, const std::vector<std::string>& texts);

/// Such as "1 h 02 min", "3 min 05 s" or "12 s".
std::string format_duration(double seconds);

/// Such as "1.20 M", "34.5 K" or "678".
std::string format_count(double value);

/// Progress line on stderr: rewritten in place on a terminal, else printed every ten seconds.
class ProgressLine {
 public:
  ~ProgressLine();
  void update(const std::string& text);
  /// Appends the remaining time. `done`: completed fraction since construction.
  void update(const std::string& text, double done);
  /// Prints the last text permanently.
  void finish();

 private:
  std::string text_;
  bool dirty_ = false;
  std::optional<Stopwatch> since_print_;
  Stopwatch since_start_;
};

/// Numbers of "AxB".
struct Pair {
  int first, second;
};
/// Parses "AxB" with both numbers in [1, max]. Throws UsageError naming the option.
Pair parse_pair(const std::string& option, const std::string& text, int max);

/// Parses "4" (MSAA) or "4x4" (supersampling). Throws UsageError naming the option.
PixelSamples parse_samples(const std::string& option, const std::string& text);

}  // namespace pictura
