#include "pictura/training/run_log.h"

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/numbers.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/configuration/config_writer.h"
#include "pictura/configuration/visit_keys.h"

namespace pictura {

namespace {

// Number of updates over which the mean return is computed.
constexpr size_t kRecentUpdates = 10;

Scalars scalars_of(const Config& config, const TrainProgress& progress, const UpdateRecord& record) {
  const SimulatorTotals& totals = record.totals;
  const UpdateStats& stats = record.stats;
  const auto steps = static_cast<double>(totals.agent_steps);
  const double km = totals.distance_m / 1000;
  Scalars scalars{
      {"charts/agent_steps", static_cast<double>(progress.agent_steps)},
      {"charts/agent_steps_per_s", progress.agent_steps_per_s},
      {"charts/learning_rate", stats.learning_rate},
      {"charts/weight_rms", stats.weights.all},
      {"charts/weight_rms_largest", stats.weights.largest},
      {"charts/image_width_px", record.image_size.width_px},
      {"charts/image_height_px", record.image_size.height_px},
      {"charts/episode_return", progress.episode_return},
      {"charts/reward_per_step", totals.reward / steps},
      {"charts/live_share", steps / static_cast<double>(totals.slot_steps)},
      {"driving/mean_speed_mps", totals.distance_m / (static_cast<double>(simulator_config(config).dt_s) * steps)}};
  const auto add_count = [&](const char* name, int64_t count) {
    scalars.emplace_back(fmt::format("driving/{}_per_km", name), static_cast<double>(count) / km);
    scalars.emplace_back(fmt::format("driving/{}_per_1000_steps", name), 1000 * static_cast<double>(count) / steps);
  };
#define X(name, logged, ...) add_count(#logged, totals.name);
  PICTURA_EVENT_TOTALS(X)
#undef X
#define X(name) scalars.emplace_back("rewards/" #name "_per_1000_steps", 1000 * totals.reward_terms.name / steps);
  PICTURA_REWARD_TERMS(X)
#undef X
  const auto add_losses = [&scalars](const std::string& suffix) {
    return [&scalars, suffix](const char* name, double value) {
      scalars.emplace_back(fmt::format("losses/{}{}", name, suffix), value);
    };
  };
  LossStats::visit_losses(stats.all, add_losses(""));
  LossStats::visit_actions(stats.first, add_losses("_first"));
  for (size_t epoch = 0; epoch < static_cast<size_t>(config.train.update_epochs); ++epoch) {
    const LossStats losses = epoch < stats.epochs.size() ? stats.epochs[epoch] : LossStats{};
    LossStats::visit_actions(losses, add_losses(fmt::format("_epoch_{}", epoch + 1)));
  }
  for (const auto& [name, value] :
       {std::pair{"losses/explained_variance", stats.explained_variance},
        std::pair{"losses/recomputed", stats.rejected ? 1.0 : 0.0}, std::pair{"losses/grad_norm", stats.all.grad_norm},
        std::pair{"losses/policy_grad_norm", stats.gradient_norms.policy},
        std::pair{"losses/value_grad_norm", stats.gradient_norms.value},
        std::pair{"losses/entropy_grad_norm", stats.gradient_norms.entropy},
        std::pair{"losses/kept_fraction", stats.kept_fraction}, std::pair{"losses/adv_threshold", stats.adv_threshold},
        std::pair{"time/rollout_s", record.rollout_s}, std::pair{"time/update_s", record.update_s}}) {
    scalars.emplace_back(name, value);
  }
  for (size_t i = 0; i < kNumPhases; ++i) {
    scalars.emplace_back(fmt::format("time/{}_s", kPhaseNames[i]), record.phases_s[i]);
  }
  // Means over agents whose episode ended; NaN without such agents.
  const auto finished = static_cast<double>(totals.finished_agent_episodes),
             moved = static_cast<double>(totals.finished_moved);
  scalars.emplace_back("agents/first_motion_s", totals.finished_first_motion_s / moved);
  scalars.emplace_back("agents/never_moved_share", 1 - moved / finished);
  scalars.emplace_back("agents/first_waypoint_share", static_cast<double>(totals.finished_passed_waypoint) / finished);
  scalars.emplace_back("agents/rest_share", record.agents.rest_share);
  for (const auto& [name, group] :
       {std::pair{"rest", &record.agents.rest}, std::pair{"moving", &record.agents.moving}}) {
    scalars.emplace_back(fmt::format("agents/kept_{}", name), group->kept_share);
    scalars.emplace_back(fmt::format("agents/advantage_{}", name), group->mean_advantage);
    for (size_t action = 0; action < group->action_shares.size(); ++action) {
      scalars.emplace_back(fmt::format("actions/{}_{}", name, action), group->action_shares[action]);
    }
  }
  return scalars;
}

Scalars scalars_of_evaluation(int64_t agent_steps, const EvaluationRecord& record) {
  Scalars scalars{{"charts/agent_steps", static_cast<double>(agent_steps)},
                  {"evaluation/image_width_px", record.image_size.width_px},
                  {"evaluation/image_height_px", record.image_size.height_px}};
  const auto add = [&scalars](const std::string& group, const EvaluateRow& row) {
    for (const auto& [name, estimate] : metrics_of(row)) {
      scalars.emplace_back(fmt::format("{}/{}", group, name), estimate.value);
      scalars.emplace_back(fmt::format("{}/{}_half_width_95", group, name), estimate.half_width_95);
    }
    scalars.emplace_back(group + "/vehicle_episodes", static_cast<double>(row.vehicle_episodes));
    scalars.emplace_back(group + "/km_driven", row.km_driven);
  };
  add("evaluation", record.row);
  if (record.average_row) add("evaluation_average", *record.average_row);
  scalars.emplace_back("time/evaluation_s", record.seconds);
  return scalars;
}

std::vector<std::string_view> whole_lines(std::string_view text) {
  std::vector<std::string_view> lines;
  for (size_t end = text.find('\n'); end != text.npos; end = text.find('\n')) {
    lines.push_back(text.substr(0, end));
    text.remove_prefix(end + 1);
  }
  return lines;
}

// Whether a line consists of num_columns numbers, the first of which is a completed update.
bool is_row(std::string_view line, size_t num_columns, int64_t updates_done) {
  std::istringstream cells{std::string(line)};
  size_t columns = 0;
  for (std::string cell; std::getline(cells, cell, ','); ++columns) {
    const std::optional<double> value = parse_written_number(cell);
    if (!value || (columns == 0 && *value > static_cast<double>(updates_done))) return false;
  }
  return columns == num_columns;
}

std::string next_free_name(const std::string& path) {
  int number = 1;
  while (std::filesystem::exists(fmt::format("{}.{}", path, number))) ++number;
  return fmt::format("{}.{}", path, number);
}

}  // namespace

ProgressCsv::ProgressCsv(const std::string& path, const Scalars& columns, int64_t updates_done,
                         const std::function<void(const std::string&)>& on_notice)
    : path_(path) {
  std::string head = "update", kept;
  for (const auto& [name, value] : columns) head += ',' + name;
  if (std::filesystem::exists(path)) {
    const std::string old = read_file(path);
    const std::vector<std::string_view> lines = whole_lines(old);
    if (!lines.empty() && lines[0] != head) {
      const std::string aside = next_free_name(path);
      std::filesystem::rename(path, aside);
      if (on_notice) on_notice(fmt::format("{}: had other columns and was renamed to {}", path, aside));
    } else {
      for (size_t i = 1; i < lines.size(); ++i) {
        if (!is_row(lines[i], columns.size() + 1, updates_done)) continue;
        kept.append(lines[i]) += '\n';
        last_update_ = std::atoll(lines[i].data());
      }
    }
  }
  write_file(path, head + '\n' + kept);
  out_.open(path, std::ios::app);
}

void ProgressCsv::write(int64_t update, const Scalars& scalars) {
  out_ << update;
  for (const auto& [name, value] : scalars) out_ << ',' << fmt::format("{:.9g}", value);
  out_ << '\n' << std::flush;
  PICTURA_CHECK(out_, "{}: writing failed: {}", path_, std::strerror(errno));
  last_update_ = update;
}

RunLog::RunLog(const std::string& folder, const Config& config, int64_t updates_done, int64_t agent_steps,
               const std::vector<RecentUpdate>& recent, const std::function<void(const std::string&)>& on_notice)
    : config_(config),
      first_update_(updates_done),
      first_agent_steps_(agent_steps),
      on_notice_(on_notice),
      folder_(folder),
      recent_(recent.begin(), recent.end()),
      minute_{{0, agent_steps}} {
  if (folder.empty()) return;
  csv_.emplace(folder + "/progress.csv", scalars_of(config, {}, {}), updates_done, on_notice);
  if (config_.train.evaluate_every > 0) {
    EvaluationRecord columns;
    if (config_.train.weight_average > 0) columns.average_row.emplace();
    evaluation_csv_.emplace(folder + "/evaluation.csv", scalars_of_evaluation(0, columns), updates_done, on_notice);
  }
}

void RunLog::write_event(int64_t agent_steps, const Scalars& scalars) {
  if (folder_.empty()) return;
  if (!events_) {
    events_.emplace(folder_);
    ConfigWriter writer;
    visit(config_, writer);
    Settings settings;
    for (const auto& [key, value] : writer.lines) settings.emplace_back(key.name, value);
    events_->write_configuration(settings, writer.toml);
  }
  events_->write(agent_steps, scalars);
}

TrainProgress RunLog::add(int64_t update, int64_t agent_steps, const UpdateRecord& record) {
  const SimulatorTotals& totals = record.totals;
  recent_.push_back({totals.finished_agent_episodes, totals.finished_return});
  if (recent_.size() > kRecentUpdates) recent_.pop_front();

  const double elapsed_s = since_start_.seconds();
  TrainProgress progress;
  progress.update = update;
  progress.updates = config_.train.updates;
  progress.agent_steps = agent_steps;
  progress.agent_steps_per_s = static_cast<double>(agent_steps - first_agent_steps_) / (elapsed_s - evaluation_s_);
  minute_.push_back({elapsed_s - evaluation_s_, agent_steps});
  while (minute_.size() > 2 && minute_.back().s - minute_.front().s > 60) minute_.pop_front();
  progress.recent_agent_steps_per_s =
      static_cast<double>(agent_steps - minute_.front().agent_steps) / (minute_.back().s - minute_.front().s);
  progress.episode_return = episode_return();
  // Time to the last update or to the end of the schedule, whichever comes first.
  const auto done = static_cast<double>(update - first_update_),
             steps_done = static_cast<double>(agent_steps - first_agent_steps_);
  progress.eta_s = elapsed_s / done * static_cast<double>(config_.train.updates - update);
  if (config_.train.schedule != Schedule::constant) {
    const auto steps_left = static_cast<double>(std::max<int64_t>(0, config_.train.schedule_agent_steps - agent_steps));
    progress.eta_s = std::min(progress.eta_s, elapsed_s / steps_done * steps_left);
  }

  if (const std::optional<LossStats>& rejected = record.stats.rejected;
      rejected && !has_reported_rejected_ && on_notice_) {
    has_reported_rejected_ = true;
    on_notice_(
        fmt::format("update {}: before its first step the learner's log-probabilities differ by {:.2g} in the mean "
                    "from the rollout's (expected less than {}), and {:.2g} of the ratios are clipped (less than {}): "
                    "the log-probabilities are recomputed, here and wherever losses/recomputed is 1",
                    update, rejected->abs_log_ratio, kMaxAbsLogRatio, rejected->clip_fraction, kMaxClipFraction));
  }

  progress.cost = {.agent_steps = totals.agent_steps,
                   .slot_steps = totals.slot_steps,
                   .kept_fraction = record.stats.kept_fraction,
                   .minibatches = record.stats.minibatches,
                   .first_kl = record.stats.first.approx_kl,
                   .rollout_s = record.rollout_s,
                   .update_s = record.update_s,
                   .phases_s = record.phases_s};

  progress.scalars = scalars_of(config_, progress, record);
  if (csv_) csv_->write(update, progress.scalars);
  write_event(agent_steps, progress.scalars);
  return progress;
}

void RunLog::add_evaluation(int64_t update, int64_t agent_steps, const EvaluationRecord& record) {
  const Scalars scalars = scalars_of_evaluation(agent_steps, record);
  if (evaluation_csv_) {
    evaluation_csv_->write(update, scalars);
    write_event(agent_steps, scalars);
  }
  evaluation_s_ += record.seconds;
}

double RunLog::episode_return() const {
  double sum = 0;
  int64_t finished = 0;
  for (const RecentUpdate& update : recent_) sum += update.finished_return, finished += update.finished;
  return sum / static_cast<double>(finished);
}

}  // namespace pictura
