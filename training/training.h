// The door of training/ for those without torch headers: train, evaluate, and drive with a saved policy.
#pragma once

#include <functional>
#include <memory>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// What a run has done so far; given to on_progress after every update.
struct TrainProgress {
  int64_t update = 0, updates = 0;
  int64_t agent_steps = 0;
  double agent_steps_per_s = 0;
  double episode_return = 0;  // mean over agent episodes that ended lately; NaN before the first
  double goals_per_km = 0;    // goals per km driven, lately
  double eta_s = 0;
};

struct TrainOptions {
  std::string config_path;             // TOML, see configs/paper.toml for every field
  std::vector<std::string> overrides;  // "train.updates=2"
  std::string out_folder;
  bool resume = false;  // go on from out_folder's checkpoint
  std::function<void(const TrainProgress&)> on_progress;
};

struct TrainReport {
  int64_t agent_steps = 0, updates = 0;
  double agent_steps_per_s = 0, episode_return = 0, km_driven = 0;
  bool interrupted = false;
  std::string checkpoint, policy_hash;
};

/// Trains as the configuration says and writes into out_folder: config.toml (resolved), untrained.ckpt (the policy
/// before its first update), checkpoint.ckpt, policy.safetensors, progress.csv and TensorBoard events. After ^C
/// (common/support/interrupt.h) it saves and returns with `interrupted`. Throws Error naming file and key for bad
/// input.
TrainReport train(const TrainOptions& options);

/// A trained policy that chooses actions for every slot of a simulator.
class Driver {
 public:
  virtual ~Driver() = default;
  /// Whether it needs images; then `renderer` below must have been made with rig().
  virtual bool needs_images() const = 0;
  virtual const Rig& rig() const = 0;
  /// The world that the policy is evaluated in: fixed conditioning and lights, the observations that it was trained on.
  virtual SimulatorConfig evaluation_world() const = 0;
  /// Fills actions_out [slots] from the simulator's present observations and, where needed, images drawn by `renderer`,
  /// which holds the simulator's geometries. argmax, or a draw from the policy (keyed as in training).
  virtual void act(Simulator& simulator, Renderer* renderer, bool argmax, Span<int32_t> actions_out) = 0;
};

/// Throws Error naming the file when it is no checkpoint, truncated, or of another observation schema.
std::unique_ptr<Driver> load_driver(const std::string& checkpoint_path, int num_threads);

enum class Density { light, medium, dense };  // 60, 120 and 150 agents a world

/// Worlds of training are numbered from 0 and are never as many.
constexpr uint32_t kFirstEvaluationWorld = 0x80000000u;

struct EvaluateOptions {
  std::string checkpoint;
  std::vector<std::string> maps;  // as load_map takes them; the paper's eight towns
  std::vector<Density> densities{Density::light, Density::medium, Density::dense};
  int agents_per_world = 0;  // > 0: instead of the densities' own numbers
  int scenarios = 200, steps = 3000;
  bool argmax = true;
  uint64_t seed = 1;
  int num_threads = 0;
  std::string backend = "auto";
  std::function<void(double done_fraction, double eta_s)> on_progress;
};

/// The paper's five metrics (appendix, metric definitions) over the vehicles of one density.
struct EvaluateRow {
  std::string density;
  int scenarios = 0, steps = 0;
  int64_t vehicle_episodes = 0;
  double at_fault_collision_rate = 0, off_road_rate = 0, red_light_rate = 0, goals_per_vehicle = 0;
  double km_per_infraction = 0;  // infinity when there was none
  double km_driven = 0;
  double waypoints_per_vehicle = 0, return_per_vehicle = 0;
};

struct EvaluateReport {
  std::vector<EvaluateRow> rows;  // of the densities that were finished, in the order in which they were asked for
  bool interrupted = false;       // ^C came (common/support/interrupt.h) before the last one was
};

/// Scenario k is on map k modulo the number of maps and draws its random numbers as world kFirstEvaluationWorld + k, so
/// that it repeats no world of training whatever the seeds. Throws Error naming file and key for bad input.
EvaluateReport evaluate(const EvaluateOptions& options);

}  // namespace pictura
