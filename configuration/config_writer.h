// Writer of a configuration as TOML.
#pragma once

#include <concepts>
#include <string>
#include <utility>
#include <vector>

#include <fmt/ranges.h>

#include "pictura/common/pixel_samples.h"
#include "pictura/common/span.h"
#include "pictura/configuration/visit_keys.h"

namespace pictura {

/// Returns the shortest TOML text from which the same number is read.
template <typename Real>
std::string shortest(Real value) {
  const std::string text = fmt::format("{}", value);
  return text.find_first_of(".en") == std::string::npos ? text + ".0" : text;
}

/// Visitor of visit() (visit_keys.h) that writes each key.
class ConfigWriter {
 public:
  template <std::integral Int>
  void value(const NamedKey& key, const Int& value, int64_t, int64_t) {
    line(key, fmt::format("{}", value));
  }
  template <typename Int>
  void value_unless(const NamedKey&, bool is_set, const NamedKey& key, const Int& its_value, int64_t low,
                    int64_t high) {
    if (!is_set) value(key, its_value, low, high);
  }
  template <std::floating_point Real>
  void value(const NamedKey& key, const Real& value, double, double) {
    line(key, shortest(value));
  }
  void value(const NamedKey& key, const bool& value) { line(key, value ? "true" : "false"); }
  void value(const NamedKey& key, const std::string& value) { line(key, quoted(value)); }
  void name(const NamedKey& key, const std::string& text, const std::vector<std::string>&) { value(key, text); }
  void device(const NamedKey& key, const std::string& text) { value(key, text); }
  void samples(const NamedKey& key, const PixelSamples& samples) { value(key, text_of(samples)); }
  void texts(const NamedKey& key, const std::vector<std::string>& values) {
    std::vector<std::string> all;
    for (const std::string& value : values) all.push_back(quoted(value));
    line(key, fmt::format("[{}]", fmt::join(all, ", ")));
  }
  void integers(const NamedKey& key, const std::vector<int>& values, int64_t, int64_t) {
    line(key, fmt::format("[{}]", fmt::join(values, ", ")));
  }
  void size_changes(const NamedKey& key, const std::vector<RenderSection::SizeChange>& values) {
    std::vector<std::string> all;
    for (const auto& change : values) {
      all.push_back(fmt::format(
          "[{}, {}, {}{}]", change.agent_steps, change.width_px, change.height_px,
          change.has_patches() ? fmt::format(", {}, {}", change.patch_px, shortest(change.line_floor_px)) : ""));
    }
    line(key, fmt::format("[{}]", fmt::join(all, ", ")));
  }
  template <typename Enum>
  void choice(const NamedKey& key, const Enum& choice, Span<const char* const> names) {
    value(key, std::string(names[static_cast<size_t>(choice)]));
  }
  void range(const NamedKey& key, const ConditioningRange& value) {
    line(key, fmt::format("[{}, {}]", value.low, value.high));
  }

  std::string toml;                                     // complete file
  std::vector<std::pair<NamedKey, std::string>> lines;  // keys, and their values as written

 private:
  static std::string quoted(const std::string& value);
  void line(const NamedKey& key, const std::string& value);

  std::string section_;
};

}  // namespace pictura
