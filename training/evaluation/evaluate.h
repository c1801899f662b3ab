// The paper's evaluation of a saved policy, without torch headers.
#pragma once

#include <functional>
#include <string>
#include <vector>

#include "pictura/common/portable/hd.h"

namespace pictura {

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
  std::string device = "auto", simulator = "auto";  // as run.device and simulator.backend of a configuration
  // As render.backend and render.samples; empty: as the policy was trained.
  std::string renderer, samples;
  // Cameras other than those of training, see SessionOptions.
  std::string rig;
  int width_px = 0, height_px = 0;
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
  std::vector<EvaluateRow> rows;  // of the densities that were finished, in the order of options.densities
  bool interrupted = false;       // ^C came (common/support/interrupt.h) before the last one was
};

/// Scenario k is on map k modulo the number of maps and draws its random numbers as world kFirstEvaluationWorld + k, so
/// that it repeats no world of training whatever the seeds. Throws Error naming file and key for bad input.
EvaluateReport evaluate(const EvaluateOptions& options);

}  // namespace pictura
