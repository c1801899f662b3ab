// The training loop, top to bottom: act, step, draw, remember; then improve; then log and save.
#include "pictura/training/training.h"

#include <chrono>
#include <cmath>
#include <deque>
#include <filesystem>
#include <fstream>
#include <sstream>

#include <ATen/Parallel.h>
#include <unistd.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/map/load_map.h"
#include "pictura/training/checkpoint.h"
#include "pictura/training/event_file.h"
#include "pictura/training/observer.h"
#include "pictura/training/ppo.h"

namespace pictura {

namespace {

using Clock = std::chrono::steady_clock;
double seconds_since(Clock::time_point start) { return std::chrono::duration<double>(Clock::now() - start).count(); }

// "Lately" in the progress line: this many updates.
constexpr size_t kRecentUpdates = 10;

double physical_memory_bytes() {
  return static_cast<double>(sysconf(_SC_PHYS_PAGES)) * static_cast<double>(sysconf(_SC_PAGESIZE));
}

// Room for what all agents see in one rollout and after it. Memory is handed out before it is there, so a rollout that
// can never fit is refused here and not killed later.
Observation allocate_rollout(const Observer& observer, const Config& config) {
  const int64_t rows = int64_t{config.train.num_steps} + 1;
  const double row_bytes = observer.bytes_per_row(), bytes = static_cast<double>(rows) * row_bytes;
  PICTURA_CHECK(
      bytes <= physical_memory_bytes(),
      "train: a rollout of {} agents (simulator.num_slots) and {} steps (train.num_steps) needs {:.1f} GB for "
      "observations of {:.0f} bytes; this machine has {:.1f} GB",
      config.simulator.num_slots, config.train.num_steps, bytes / 1e9, row_bytes / config.simulator.num_slots,
      physical_memory_bytes() / 1e9);
  return observer.allocate(rows);
}

// What happened in one rollout: differences of the simulator's totals.
struct TotalsDelta {
  int64_t agent_steps = 0, slot_steps = 0, goals = 0, waypoints = 0, finished = 0;
  int64_t collisions = 0, at_fault = 0, off_road = 0, red_light = 0, wall_contacts = 0;
  double distance_m = 0, finished_return = 0, reward = 0;

  void add(const SimulatorTotals& totals, int sign) {
    agent_steps += sign * totals.agent_steps;
    slot_steps += sign * totals.slot_steps;
    goals += sign * totals.goals_reached;
    waypoints += sign * totals.waypoints_reached;
    finished += sign * totals.finished_agent_episodes;
    collisions += sign * totals.collisions;
    at_fault += sign * totals.at_fault_collisions;
    off_road += sign * totals.off_road;
    red_light += sign * totals.red_light;
    wall_contacts += sign * totals.wall_contacts;
    distance_m += sign * totals.distance_m;
    finished_return += sign * totals.finished_return;
    reward += sign * totals.reward;
  }
};

// One CSV per run. On resume the rows of updates that the checkpoint does not hold are dropped.
class ProgressCsv {
 public:
  ProgressCsv(const std::string& path, int64_t updates_done) : path_(path) {
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

  void write(int64_t update, const Scalars& scalars) {
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

 private:
  std::string path_;
  std::ofstream out_;
  bool needs_head_ = true;
};

std::vector<std::shared_ptr<const RoadMap>> load_maps(const std::vector<std::string>& names) {
  std::vector<std::shared_ptr<const RoadMap>> maps;
  for (const std::string& name : names) maps.push_back(load_map(name));
  return maps;
}

std::unique_ptr<Simulator> make_training_simulator(const Config& config) {
  const Config::SimulatorSection& section = config.simulator;
  return make_simulator(simulator_name(config.run.backend), simulator_config(config), load_maps(section.maps),
                        draw_worlds(config.run.seed, section.num_slots, section.min_agents, section.max_agents,
                                    static_cast<int>(section.maps.size())));
}

class Trainer {
 public:
  Trainer(const Config& config, std::string out_folder)
      : config_(config),
        out_folder_(std::move(out_folder)),
        rig_(rig_of(config)),
        simulator_(make_training_simulator(config)),
        renderer_(config.policy.modality == Modality::perspective ? make_policy_renderer(config, rig_, *simulator_)
                                                                  : nullptr),
        observer_(simulator_.get(), renderer_.get()),
        policy_(config.policy, static_cast<int>(rig_.cameras.size()), config.run.seed),
        optimizer_(policy_, config.train),
        rollout_(allocate_rollout(observer_, config), config.train.num_steps, simulator_->num_slots()) {}

  std::string checkpoint_path() const { return out_folder_ + "/checkpoint.ckpt"; }

  void start() {
    simulator_->reset();
    write_file(out_folder_ + "/config.toml", to_toml(config_));
    save(out_folder_ + "/untrained.ckpt", simulator_->save());
  }

  void resume() {
    const Checkpoint saved = read_checkpoint(checkpoint_path());
    const std::string difference = first_difference(saved.config, config_);
    PICTURA_CHECK(difference.empty(), "{}: saved under another configuration: {}", saved.path, difference);
    const std::string rig_difference = first_difference(saved.rig, rig_);
    PICTURA_CHECK(rig_difference.empty(), "{}: saved with other cameras than {} has: {}", saved.path,
                  config_.render.rig.empty() ? "the paper's rig" : config_.render.rig, rig_difference);
    restore_tensors(saved, saved.parameters, policy_.parameters());
    restore_tensors(saved, saved.first_moments, optimizer_.first_moments);
    restore_tensors(saved, saved.second_moments, optimizer_.second_moments);
    optimizer_.steps = saved.adam_steps;
    filter_.average = saved.filter_average;
    recent_.assign(saved.recent.begin(), saved.recent.end());
    simulator_->restore(saved.simulator);
    update_ = saved.update;
    agent_steps_ = saved.agent_steps;
    distance_m_ = saved.distance_m;
    write_file(out_folder_ + "/config.toml", to_toml(config_));
  }

  TrainReport run(const std::function<void(const TrainProgress&)>& on_progress) {
    TrainReport report;
    EventFile events(out_folder_);
    ProgressCsv csv(out_folder_ + "/progress.csv", update_);
    observe_into(config_.train.num_steps);
    const int64_t first_update = update_, first_agent_steps = agent_steps_;
    const auto start = Clock::now();

    while (update_ < config_.train.updates && !report.interrupted) {
      const std::vector<uint8_t> boundary = simulator_->save();
      TotalsDelta happened;
      happened.add(simulator_->totals(), -1);
      const double rate = cosine_rate(config_.train.learning_rate, update_, config_.train.schedule_updates);
      const double render_before_s = observer_.render_s();
      const auto rollout_start = Clock::now();
      forward_s_ = simulate_s_ = 0;
      if (!collect()) {
        // ^C within a rollout: what is saved is the state at its start, from which resuming is exact.
        save(checkpoint_path(), boundary);
        report.interrupted = true;
        break;
      }
      const double rollout_s = seconds_since(rollout_start);
      happened.add(simulator_->totals(), +1);

      const auto optimize_start = Clock::now();
      rollout_.compute_advantages(config_.train.gamma, config_.train.gae_lambda);
      const UpdateStats stats =
          ppo_update(policy_, rollout_, config_.train, config_.run.seed, update_, &optimizer_, &filter_);
      const double optimize_s = seconds_since(optimize_start);

      ++update_;
      agent_steps_ += happened.agent_steps;
      distance_m_ += happened.distance_m;
      recent_.push_back({happened.goals, happened.finished, happened.distance_m, happened.finished_return});
      if (recent_.size() > kRecentUpdates) recent_.pop_front();

      const double elapsed_s = seconds_since(start);
      TrainProgress progress;
      progress.update = update_;
      progress.updates = config_.train.updates;
      progress.agent_steps = agent_steps_;
      progress.agent_steps_per_s = static_cast<double>(agent_steps_ - first_agent_steps) / elapsed_s;
      progress.episode_return = episode_return();
      progress.goals_per_km = goals_per_km();
      progress.eta_s = elapsed_s / static_cast<double>(update_ - first_update) *
                       static_cast<double>(config_.train.updates - update_);

      const Scalars scalars =
          scalars_of(progress, happened, stats, rate,
                     {rollout_s, forward_s_, simulate_s_, observer_.render_s() - render_before_s, optimize_s});
      csv.write(update_, scalars);
      events.write(agent_steps_, scalars);
      report.agent_steps_per_s = progress.agent_steps_per_s;
      report.interrupted = interrupted();
      if (report.interrupted || update_ == config_.train.updates || update_ % config_.train.checkpoint_every == 0) {
        save(checkpoint_path(), simulator_->save());
      }
      if (on_progress) on_progress(progress);
    }

    write_safetensors(out_folder_ + "/policy.safetensors", policy_.parameters(), to_toml(config_));
    report.agent_steps = agent_steps_;
    report.updates = update_;
    report.episode_return = episode_return();
    report.km_driven = distance_m_ / 1000;
    report.checkpoint = checkpoint_path();
    report.policy_hash = policy_.hash();
    return report;
  }

 private:
  struct PhaseTimes {
    double rollout_s, forward_s, simulate_s, render_s, optimize_s;
  };

  // Fills the rollout; false when ^C came.
  bool collect() {
    const int64_t num_steps = rollout_.num_steps(), num_slots = rollout_.num_slots();
    // The first row is the last one of the rollout before.
    observation_row(0).copy_from(observation_row(num_steps));
    for (int64_t t = 0; t < num_steps; ++t) {
      if (interrupted()) return false;
      const auto forward_start = Clock::now();
      const Decision decision = decide(policy_, row_of(rollout_.observation, t), config_.train.forward_chunk);
      const at::Tensor actions = rollout_.actions.select(0, t);
      const Span<int32_t> actions_span{actions.data_ptr<int32_t>(), static_cast<size_t>(num_slots)};
      choose_actions(decision.log_probs, *simulator_, config_.run.seed, /*argmax=*/false, actions_span);
      rollout_.values.select(0, t).copy_(decision.value);
      rollout_.log_probs.select(0, t).copy_(
          decision.log_probs.gather(1, actions.to(at::kLong).unsqueeze(1)).squeeze(1));
      forward_s_ += seconds_since(forward_start);

      const auto simulate_start = Clock::now();
      const StepResult result = simulator_->step(Span<const int32_t>(actions_span));
      simulate_s_ += seconds_since(simulate_start);
      std::copy(result.reward.begin(), result.reward.end(), rollout_.rewards.data_ptr<float>() + t * num_slots);
      std::copy(result.terminated.begin(), result.terminated.end(),
                rollout_.terminated.data_ptr<uint8_t>() + t * num_slots);
      std::copy(result.truncated.begin(), result.truncated.end(),
                rollout_.truncated.data_ptr<uint8_t>() + t * num_slots);
      std::copy(result.valid.begin(), result.valid.end(), rollout_.valid.data_ptr<uint8_t>() + t * num_slots);
      observe_into(t + 1);
    }
    const Decision last = decide(policy_, row_of(rollout_.observation, num_steps), config_.train.forward_chunk);
    rollout_.values.select(0, num_steps).copy_(last.value);
    return true;
  }

  void observe_into(int64_t row) { observer_.observe(row_of(rollout_.observation, row)); }

  struct Row {
    Observation row;
    void copy_from(const Row& other) {
      std::vector<at::Tensor> sources;
      other.row.map([&](const at::Tensor& t) { return sources.emplace_back(t); });
      size_t i = 0;
      row.map([&](at::Tensor t) { return t.copy_(sources[i++]); });
    }
  };
  Row observation_row(int64_t row) { return {row_of(rollout_.observation, row)}; }

  double episode_return() const {
    double sum = 0;
    int64_t finished = 0;
    for (const RecentUpdate& h : recent_) sum += h.finished_return, finished += h.finished;
    return sum / static_cast<double>(finished);  // NaN before the first
  }
  double goals_per_km() const {
    double km = 0;
    int64_t goals = 0;
    for (const RecentUpdate& h : recent_) km += h.distance_m / 1000, goals += h.goals;
    return static_cast<double>(goals) / km;
  }

  Scalars scalars_of(const TrainProgress& progress, const TotalsDelta& h, const UpdateStats& stats, double rate,
                     const PhaseTimes& times) const {
    const auto steps = static_cast<double>(h.agent_steps);
    const double km = h.distance_m / 1000;
    return {{"charts/agent_steps", static_cast<double>(progress.agent_steps)},
            {"charts/agent_steps_per_s", progress.agent_steps_per_s},
            {"charts/learning_rate", rate},
            {"charts/episode_return", progress.episode_return},
            {"charts/reward_per_step", h.reward / steps},
            {"charts/live_share", steps / static_cast<double>(h.slot_steps)},
            {"driving/mean_speed_mps", h.distance_m / (static_cast<double>(simulator_->config().dt_s) * steps)},
            {"driving/goals_per_km", static_cast<double>(h.goals) / km},
            {"driving/waypoints_per_km", static_cast<double>(h.waypoints) / km},
            {"driving/waypoints_per_1000_steps", 1000 * static_cast<double>(h.waypoints) / steps},
            {"driving/collisions_per_km", static_cast<double>(h.collisions) / km},
            {"driving/at_fault_collisions_per_km", static_cast<double>(h.at_fault) / km},
            {"driving/off_road_per_km", static_cast<double>(h.off_road) / km},
            {"driving/red_light_per_km", static_cast<double>(h.red_light) / km},
            {"driving/wall_contacts_per_km", static_cast<double>(h.wall_contacts) / km},
            {"losses/policy_loss", stats.policy_loss},
            {"losses/value_loss", stats.value_loss},
            {"losses/entropy", stats.entropy},
            {"losses/approx_kl", stats.approx_kl},
            {"losses/clip_fraction", stats.clip_fraction},
            {"losses/explained_variance", stats.explained_variance},
            {"losses/grad_norm", stats.grad_norm},
            {"losses/kept_fraction", stats.kept_fraction},
            {"losses/adv_threshold", stats.adv_threshold},
            {"time/rollout_s", times.rollout_s},
            {"time/forward_s", times.forward_s},
            {"time/simulate_s", times.simulate_s},
            {"time/render_s", times.render_s},
            {"time/optimize_s", times.optimize_s}};
  }

  void save(const std::string& path, const std::vector<uint8_t>& simulator_bytes) const {
    Checkpoint checkpoint;
    checkpoint.config = config_;
    checkpoint.rig = rig_;
    checkpoint.update = update_;
    checkpoint.agent_steps = agent_steps_;
    checkpoint.distance_m = distance_m_;
    checkpoint.adam_steps = optimizer_.steps;
    checkpoint.filter_average = filter_.average;
    checkpoint.recent.assign(recent_.begin(), recent_.end());
    checkpoint.parameters = policy_.parameters();
    checkpoint.first_moments = optimizer_.first_moments;
    checkpoint.second_moments = optimizer_.second_moments;
    checkpoint.simulator = simulator_bytes;
    write_checkpoint(path, checkpoint);
  }

  const Config config_;
  const std::string out_folder_;
  const Rig rig_;
  const std::unique_ptr<Simulator> simulator_;
  const std::unique_ptr<Renderer> renderer_;
  Observer observer_;
  const Policy policy_;
  AdamW optimizer_;
  AdvantageFilter filter_;
  Rollout rollout_;
  int64_t update_ = 0, agent_steps_ = 0;
  double distance_m_ = 0;
  std::deque<RecentUpdate> recent_;
  double forward_s_ = 0, simulate_s_ = 0;
};

}  // namespace

TrainReport train(const TrainOptions& options) {
  const Config config = load_config(options.config_path, options.overrides);
  make_output_folder(options.out_folder);
  at::set_num_threads(resolve_num_threads(config.run.num_threads));
  Trainer trainer(config, options.out_folder);
  if (options.resume)
    trainer.resume();
  else
    trainer.start();
  return trainer.run(options.on_progress);
}

}  // namespace pictura
