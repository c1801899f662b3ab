#include "pictura/training/run_log.h"

#include <filesystem>
#include <sstream>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"

namespace pictura {

namespace {

// The progress line averages over this many updates.
constexpr size_t kRecentUpdates = 10;

Scalars scalars_of(const Config& config, const TrainProgress& progress, const UpdateRecord& record) {
  const SimulatorTotals& totals = record.totals;
  const UpdateStats& stats = record.stats;
  const auto steps = static_cast<double>(totals.agent_steps);
  const double km = totals.distance_m / 1000;
  auto per_km = [km](int64_t count) { return static_cast<double>(count) / km; };
  Scalars scalars{
      {"charts/agent_steps", static_cast<double>(progress.agent_steps)},
      {"charts/agent_steps_per_s", progress.agent_steps_per_s},
      {"charts/learning_rate",
       cosine_rate(config.train.learning_rate, progress.update - 1, config.train.schedule_updates)},
      {"charts/episode_return", progress.episode_return},
      {"charts/reward_per_step", totals.reward / steps},
      {"charts/live_share", steps / static_cast<double>(totals.slot_steps)},
      {"driving/mean_speed_mps", totals.distance_m / (static_cast<double>(simulator_config(config).dt_s) * steps)},
      {"driving/goals_per_km", per_km(totals.goals_reached)},
      {"driving/waypoints_per_km", per_km(totals.waypoints_reached)},
      {"driving/waypoints_per_1000_steps", 1000 * static_cast<double>(totals.waypoints_reached) / steps},
      {"driving/collisions_per_km", per_km(totals.collisions)},
      {"driving/at_fault_collisions_per_km", per_km(totals.at_fault_collisions)},
      {"driving/off_road_per_km", per_km(totals.off_road)},
      {"driving/red_light_per_km", per_km(totals.red_light)},
      {"driving/wall_contacts_per_km", per_km(totals.wall_contacts)},
      {"losses/policy_loss", stats.policy_loss},
      {"losses/value_loss", stats.value_loss},
      {"losses/entropy", stats.entropy},
      {"losses/approx_kl", stats.approx_kl},
      {"losses/clip_fraction", stats.clip_fraction},
      {"losses/explained_variance", stats.explained_variance},
      {"losses/grad_norm", stats.grad_norm},
      {"losses/kept_fraction", stats.kept_fraction},
      {"losses/adv_threshold", stats.adv_threshold},
      {"time/rollout_s", record.rollout_s},
      {"time/update_s", record.update_s}};
  for (size_t i = 0; i < kNumPhases; ++i) {
    scalars.emplace_back(fmt::format("time/{}_s", kPhaseNames[i]), record.phases_s[i]);
  }
  return scalars;
}

}  // namespace

ProgressCsv::ProgressCsv(const std::string& path, int64_t updates_done) : path_(path) {
  std::string kept;
  if (updates_done > 0 && std::filesystem::exists(path)) {
    std::istringstream lines(read_file(path));
    for (std::string line; std::getline(lines, line);) {
      if (kept.empty() || std::atoll(line.c_str()) <= updates_done) kept += line + '\n';
    }
  }
  write_file(path, kept);
  out_.open(path, std::ios::app);
  needs_head_ = kept.empty();
}

void ProgressCsv::write(int64_t update, const Scalars& scalars) {
  if (needs_head_) {
    out_ << "update";
    for (const auto& [name, value] : scalars) out_ << ',' << name;
    out_ << '\n';
    needs_head_ = false;
  }
  out_ << update;
  for (const auto& [name, value] : scalars) out_ << ',' << fmt::format("{:.9g}", value);
  out_ << '\n' << std::flush;
  PICTURA_CHECK(out_, "{}: writing failed", path_);
}

RunLog::RunLog(const std::string& folder, const Config& config, int64_t updates_done, int64_t agent_steps,
               const std::vector<RecentUpdate>& recent)
    : config_(config),
      first_update_(updates_done),
      first_agent_steps_(agent_steps),
      events_(folder),
      csv_(folder + "/progress.csv", updates_done),
      recent_(recent.begin(), recent.end()) {}

TrainProgress RunLog::add(int64_t update, int64_t agent_steps, const UpdateRecord& record) {
  const SimulatorTotals& totals = record.totals;
  recent_.push_back({totals.goals_reached, totals.finished_agent_episodes, totals.distance_m, totals.finished_return});
  if (recent_.size() > kRecentUpdates) recent_.pop_front();

  const double elapsed_s = since_start_.seconds();
  TrainProgress progress;
  progress.update = update;
  progress.updates = config_.train.updates;
  progress.agent_steps = agent_steps;
  progress.agent_steps_per_s = static_cast<double>(agent_steps - first_agent_steps_) / elapsed_s;
  progress.episode_return = episode_return();
  progress.goals_per_km = goals_per_km();
  progress.eta_s =
      elapsed_s / static_cast<double>(update - first_update_) * static_cast<double>(config_.train.updates - update);

  const Scalars scalars = scalars_of(config_, progress, record);
  csv_.write(update, scalars);
  events_.write(agent_steps, scalars);
  return progress;
}

double RunLog::episode_return() const {
  double sum = 0;
  int64_t finished = 0;
  for (const RecentUpdate& update : recent_) sum += update.finished_return, finished += update.finished;
  return sum / static_cast<double>(finished);
}

double RunLog::goals_per_km() const {
  double km = 0;
  int64_t goals = 0;
  for (const RecentUpdate& update : recent_) km += update.distance_m / 1000, goals += update.goals;
  return static_cast<double>(goals) / km;
}

}  // namespace pictura
