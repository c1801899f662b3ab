#include "pictura/configuration/config_keys.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include <fmt/ranges.h>

#include "pictura/common/pixel_samples.h"
#include "pictura/common/support/numbers.h"
#include "pictura/configuration/config_writer.h"
#include "pictura/configuration/visit_keys.h"
#include "pictura/configuration/visit_paths.h"

namespace pictura {

namespace {

// Visitor that describes the values and the default of each key, for documents.
class Describer {
 public:
  explicit Describer(const Config& defaults) { visit(defaults, writer_); }

  template <std::integral Int>
  void value(const std::string& key, const Int&, int64_t low, int64_t high) {
    add(key, fmt::format("{} to {}", low, high));
  }
  template <typename Int>
  void value_unless(const std::string& other, bool, const std::string& key, const Int&, int64_t low, int64_t high) {
    add(key, fmt::format("{} to {}, without `{}`", low, high, other));
  }
  void value(const std::string& key, const double&, double low, double high) {
    add(key, std::isinf(high) ? fmt::format("{} or more", text_of_number(low))
                              : fmt::format("{} to {}", text_of_number(low), text_of_number(high)));
  }
  void value(const std::string& key, const bool&) { add(key, "true, false"); }
  void value(const std::string& key, const std::string&) { add(key, "a text"); }
  void name(const std::string& key, const std::string&, const std::vector<std::string>& known) {
    // The description does not list backends, because they depend on the build.
    add(key, key.ends_with(".backend") ? "a backend" : fmt::format("{}", fmt::join(known, ", ")));
  }
  void device(const std::string& key, const std::string&) { add(key, kDevices); }
  void samples(const std::string& key, const PixelSamples&) { add(key, kPixelSamplesExpected); }
  void texts(const std::string& key, const std::vector<std::string>&) { add(key, "a list of texts"); }
  void integers(const std::string& key, const std::vector<int>&, int64_t low, int64_t high) {
    add(key, fmt::format("a list of {} to {}", low, high));
  }
  void size_changes(const std::string& key, const std::vector<RenderSection::SizeChange>&) {
    add(key, fmt::format("{}, in ascending order", kSizeChangesExpected));
  }
  template <typename Enum>
  void choice(const std::string& key, const Enum&, Span<const char* const> names) {
    add(key, fmt::format("{}", fmt::join(names, ", ")));
  }
  void range(const std::string& key, const ConditioningRange& value) {
    add(key, value.mixture ? "0 < low <= 1 <= high, or low = high > 0"
                           : fmt::format("low <= high, both from {} to {}", text_of_number(-kMaxConditioning),
                                         text_of_number(kMaxConditioning)));
  }

  std::vector<ConfigKey> keys;

 private:
  void add(const std::string& key, const std::string& values) {
    const auto line = std::find_if(writer_.lines.begin(), writer_.lines.end(),
                                   [&key](const auto& each) { return each.first.name == key; });
    keys.push_back({key, line->second, values});
  }
  ConfigWriter writer_;
};

}  // namespace

std::vector<ConfigKey> config_keys() {
  const Config defaults;
  Describer describer(defaults);
  visit(defaults, describer);
  return describer.keys;
}

std::vector<std::string> settings_without_effect(const Config& config) {
  std::vector<std::string> notices;
  const int64_t rollout = int64_t{config.simulator.num_slots} * config.train.num_steps;
  if (config.train.minibatch_size > rollout) {
    notices.push_back(
        fmt::format("train.minibatch_size: {} are more than the transitions of a rollout (simulator."
                    "num_slots x train.num_steps = {}): each epoch is one minibatch",
                    config.train.minibatch_size, rollout));
  }
  return notices;
}

Config with_absolute_paths(Config config) {
  visit_paths(&config, [](std::string_view, std::string* path_inout) {
    *path_inout = std::filesystem::absolute(*path_inout).lexically_normal().string();
  });
  return config;
}

}  // namespace pictura
