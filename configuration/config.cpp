#include "pictura/configuration/config.h"

#include "pictura/common/error.h"
#include "pictura/common/support/numbers.h"
#include "pictura/configuration/config_writer.h"
#include "pictura/configuration/visit_keys.h"

namespace pictura {

std::array<double, kNumConditioning> EvaluateSection::default_conditioning() {
  // Conditioning for safe and fast driving: full penalties, no lane bias, goals within 2 m at any speed, unscaled
  // dynamics.
  std::array<double, kNumConditioning> values{};
  auto set = [&](Conditioning which, double value) { values[static_cast<size_t>(which)] = value; };
  set(Conditioning::delta_goal_m, 2);
  set(Conditioning::v_goal_mps, 20);
  set(Conditioning::collision, 3);
  set(Conditioning::off_road, 3);
  set(Conditioning::stop_line, 1);
  set(Conditioning::comfort, 0.05);
  set(Conditioning::lane_align, 2.5e-2);
  set(Conditioning::vel_align, 1);
  set(Conditioning::lane_center, 7.5e-3);
  set(Conditioning::center_bias_m, 0);
  set(Conditioning::velocity, 2.5e-3);
  set(Conditioning::reverse, 7.5e-3);
  set(Conditioning::overspeed, 0.05);
  set(Conditioning::timestep, 2.5e-5);
  set(Conditioning::throttle, 1);
  set(Conditioning::steer, 1);
  set(Conditioning::acceleration, 1);
  return values;
}

bool Config::reads(ObservationPart part) const {
  return part == ObservationPart::own ||
         (policy.modality == Modality::vector && (part != ObservationPart::walls || simulator.wall_observations));
}

SceneProtocol SceneSection::training_protocol() const {
  SceneProtocol result = scene_protocol(protocol);
  if (!control.empty()) result.control = control;
  for (const std::string& rule : rules) set_scene_rule(rule, &result);
  check(result);
  const auto refuse = [](bool is_chosen, const char* rule, const char* supported) {
    if (is_chosen) fail_usage("rule {}: expected {} in training, which knows no other value", rule, supported);
  };
  refuse(result.late == Late::drive, "late", "replay or absent");
  refuse(result.record_end != RecordEnd::stand, "record_end", "stand");
  refuse(result.waypoints != Waypoints::goal, "waypoints", "goal");
  return result;
}

constexpr std::string_view kScenesPrefix = "scenes:";

std::optional<std::string> scene_source(const std::string& map) {
  if (!map.starts_with(kScenesPrefix)) return std::nullopt;
  return map.substr(kScenesPrefix.size());
}

std::string map_of_scenes(const std::string& source) { return fmt::format("{}{}", kScenesPrefix, source); }

bool SimulatorSection::has_scenes() const { return !maps.empty() && scene_source(maps.front()).has_value(); }

std::optional<NamedShare> parse_share(const std::string& text) {
  const size_t sign = text.rfind('=');
  if (sign == std::string::npos || sign == 0) return std::nullopt;
  const std::optional<double> share = parse_number(std::string_view(text).substr(sign + 1));
  if (!share || !(*share > 0)) return std::nullopt;
  return NamedShare{text.substr(0, sign), *share};
}

bool is_device(std::string_view text) {
  if (text == "cpu" || text == "cuda" || text == "auto") return true;
  constexpr std::string_view kPrefix = "cuda:";
  constexpr size_t kMaxDigits = 3;
  return text.starts_with(kPrefix) && text.size() > kPrefix.size() && text.size() <= kPrefix.size() + kMaxDigits &&
         text.find_first_not_of("0123456789", kPrefix.size()) == std::string_view::npos;
}

std::string to_toml(const Config& config) {
  ConfigWriter writer;
  visit(config, writer);
  return writer.toml;
}

std::string name_of(Precision precision) { return kPrecisions[static_cast<size_t>(precision)]; }
std::string name_of(OptimizerKind kind) { return kOptimizers[static_cast<size_t>(kind)]; }

}  // namespace pictura
