#include "pictura/cli/report.h"

#include <algorithm>
#include <cmath>

#include <sys/ioctl.h>
#include <unistd.h>

#include "pictura/common/error.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/common/support/json_text.h"
#include "pictura/common/support/numbers.h"

namespace pictura {

void print_json(const Json& object) { print_result_text(json_text(object, 2) + "\n"); }

void print_warnings(const std::string& what, const std::vector<std::string>& texts) {
  constexpr size_t kShown = 10;
  for (size_t i = 0; i < std::min(texts.size(), kShown); ++i) {
    print_message("warning: {}: {}\n", what, printable(texts[i]));
  }
  if (texts.size() > kShown) {
    print_message("warning: {}: {} more; --json lists all\n", what, texts.size() - kShown);
  }
}

std::string format_duration(double seconds) {
  if (!std::isfinite(seconds)) return "?";
  const auto total = static_cast<long>(std::lround(seconds));
  if (total >= 3600) return fmt::format("{} h {:02} min", total / 3600, total / 60 % 60);
  if (total >= 60) return fmt::format("{} min {:02} s", total / 60, total % 60);
  return fmt::format("{} s", total);
}

std::string format_count(double value) {
  if (value >= 1e6) return fmt::format("{:.2f} M", value / 1e6);
  if (value >= 1e3) return fmt::format("{:.1f} K", value / 1e3);
  return fmt::format("{:.0f}", value);
}

namespace {

/// Returns the part of a line that fits the width of the terminal, because a wrapped line cannot be rewritten in place.
/// Returns the whole line if stderr has no width.
std::string shown(const std::string& line) {
  winsize size{};
  const bool has_width = ioctl(STDERR_FILENO, TIOCGWINSZ, &size) == 0 && size.ws_col > 1;
  return has_width ? line.substr(0, size.ws_col - 1u) : line;
}

}  // namespace

ProgressLine::~ProgressLine() { finish(); }

void ProgressLine::update(const std::string& text) {
  text_ = text;
  dirty_ = true;
  const bool terminal = isatty(STDERR_FILENO) != 0;
  if (since_print_ && since_print_->seconds() < (terminal ? 0.2 : 10)) return;
  since_print_.emplace();
  print_message_text(terminal ? "\r\033[K" + shown(text_) : text_ + "\n");
  dirty_ = terminal;
}

void ProgressLine::update(const std::string& text, double done) {
  const double elapsed_s = since_start_.seconds();
  update(fmt::format("{}  ETA {}", text, format_duration(elapsed_s * (1 - done) / done)));
}

void ProgressLine::finish() {
  if (!dirty_) return;
  print_message_text((isatty(STDERR_FILENO) ? "\r\033[K" : "") + text_ + "\n");
  dirty_ = false;
}

Pair parse_pair(const std::string& option, const std::string& text, int max) {
  const std::size_t cross = std::min(text.find('x'), text.size());
  const auto count = [max](std::string_view part) {
    const std::optional<uint64_t> value = parse_unsigned(part);
    return value && *value >= 1 && *value <= static_cast<uint64_t>(max) ? static_cast<int>(*value) : 0;
  };
  const Pair pair{count(std::string_view(text).substr(0, cross)),
                  cross < text.size() ? count(std::string_view(text).substr(cross + 1)) : 0};
  if (pair.first < 1 || pair.second < 1) {
    fail_usage("{}: expected two numbers of 1 to {} like 4x3, got '{}'", option, max, text);
  }
  return pair;
}

PixelSamples parse_samples(const std::string& option, const std::string& text) {
  const std::optional<PixelSamples> samples = parse_pixel_samples(text);
  if (!samples) fail_usage("{}: expected {}, got '{}'", option, kPixelSamplesExpected, text);
  return *samples;
}

}  // namespace pictura
