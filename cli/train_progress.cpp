#include "pictura/cli/train_progress.h"

#include <algorithm>
#include <cmath>

#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/training/phases.h"

namespace pictura {
namespace {

double scalar(const TrainProgress& progress, std::string_view name) {
  const auto found = std::find_if(progress.scalars.begin(), progress.scalars.end(),
                                  [name](const auto& scalar) { return scalar.first == name; });
  PICTURA_CHECK(found != progress.scalars.end(), "progress of training: expected a scalar '{}'", name);
  return found->second;
}

}  // namespace

std::string phase_shares(const TrainProgress& progress) {
  const double whole_s = scalar(progress, "time/rollout_s") + scalar(progress, "time/update_s");
  std::string text;
  double other = 1;
  for (const char* phase : kPhaseNames) {
    const double share = scalar(progress, fmt::format("time/{}_s", phase)) / whole_s;
    text += fmt::format("{} {:.0f} %, ", phase, 100 * share);
    other -= share;
  }
  return text + fmt::format("other {:.0f} %", 100 * std::max(0.0, other));
}

std::string progress_text(const TrainProgress& progress) {
  const std::string episode_return =
      std::isfinite(progress.episode_return) ? fmt::format("{:.2f}", progress.episode_return) : "-";
  const auto per_km = [&progress](const char* event) {
    return scalar(progress, fmt::format("driving/{}_per_km", event));
  };
  const double infractions_per_km = per_km("at_fault_collisions") + per_km("off_road") + per_km("red_light");
  const std::string km = infractions_per_km > 0 ? fmt::format("{:.2f}", 1 / infractions_per_km) : "-";
  return fmt::format(
      "update {}/{}  ETA {}{}  {} agent-steps  {}/s  return {}  {:.1f} m/s  {:.2f} goals/km  {} km/infraction",
      progress.update, progress.updates, progress.ends_by_minutes ? "at most " : "", format_duration(progress.eta_s),
      format_count(static_cast<double>(progress.agent_steps)), format_count(progress.recent_agent_steps_per_s),
      episode_return, scalar(progress, "driving/mean_speed_mps"), per_km("goals"), km);
}

}  // namespace pictura
