#include "pictura/cli/backend_options.h"

#include <algorithm>

#include <fmt/ranges.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/common/pixel_samples.h"
#include "pictura/common/support/messages.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/configuration/run_section.h"

namespace pictura {

CLI::Validator one_of(const std::vector<std::string>& names) {
  auto complaint = [names](const std::string& text) -> std::string {
    if (std::find(names.begin(), names.end(), text) != names.end()) return "";
    return fmt::format("expected one of {}; got '{}'{}", fmt::join(names, ", "), text, suggestion(text, names));
  };
  return {complaint, ""};
}

CLI::Validator device_name() {
  auto complaint = [](const std::string& text) -> std::string {
    return is_device(text) ? "" : fmt::format("expected one of {}; got '{}'", kDevices, text);
  };
  return {complaint, ""};
}

std::function<std::string(std::string)> renaming(const std::string& flag, const RenamedChoice& renamed) {
  return [flag, renamed](const std::string& text) -> std::string {
    if (text != renamed.old_name) return text;
    print_message("warning: {}\n", renamed.warning(flag));
    return renamed.name;
  };
}

void add_backend_options(CLI::App* command, const std::string& otherwise, SessionOptions* options_out) {
  const auto described = [&otherwise](const char* what, const std::vector<std::string>& names) {
    return fmt::format("{}: {}; default: {}", what, fmt::join(names, ", "), otherwise);
  };
  command->add_option("--simulator", options_out->simulator, described("Backend of the simulator", simulator_names()))
      ->check(one_of(simulator_names()));
  command
      ->add_option("--renderer,--backend", options_out->renderer,
                   described("Backend of the renderer", renderer_names()))
      ->check(one_of(renderer_names()));
  auto complaint = [](const std::string& text) -> std::string {
    return parse_pixel_samples(text) ? "" : fmt::format("expected {}, got '{}'", kPixelSamplesExpected, text);
  };
  command
      ->add_option("--samples", options_out->samples,
                   "Samples per pixel of the renderer gl: 1, N (MSAA) or NxN (supersampling); other renderers compute "
                   "exact coverage")
      ->check(CLI::Validator(complaint, ""));
}

void add_policy_backend_options(CLI::App* command, const std::string& otherwise, SessionOptions* options_out) {
  command
      ->add_option("--device", options_out->device,
                   fmt::format("Device of the policy: cpu, cuda, cuda:N or auto; default: {}", otherwise))
      ->check(device_name());
  add_backend_options(command, otherwise, options_out);
}

std::vector<std::string> overrides_of(const SessionOptions& options) {
  std::vector<std::string> overrides;
  for (const auto& [key, value] :
       {std::pair{"run.device", &options.device}, std::pair{"simulator.backend", &options.simulator},
        std::pair{"render.backend", &options.renderer}, std::pair{"render.samples", &options.samples}}) {
    if (!value->empty()) overrides.push_back(fmt::format("{}={}", key, *value));
  }
  return overrides;
}

}  // namespace pictura
