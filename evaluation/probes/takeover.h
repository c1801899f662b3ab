// Takeovers: a policy drives an ego from a state of a driven scene, while all other agents repeat their motion.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <map>
#include <memory>
#include <vector>

#include "pictura/evaluation/probes/driven_scenes.h"
#include "pictura/map/line_of_sight.h"
#include "pictura/simulator/saved_worlds.h"

namespace pictura {

class ProbeRun;
struct ProbeOptions;

constexpr int kTakeoverSteps = 80;
constexpr double kTakeoverStep_s = 0.1;

/// Runs per pass through a network. A run keeps its row in every pass, so that equal inputs give bit-identical outputs.
constexpr int takeover_pass(Device device) { return device.is_host() ? 8 : 256; }

struct TakeoverStart {
  const DrivenScene* scene = nullptr;
  const SavedWorld* world = nullptr;  // state at the takeover
  int32_t step = 0, ego = 0;          // step: completed steps
  int32_t user = -1;                  // hidden vehicle; -1: none
  int32_t removed = -1;               // removed agent; -1: none
};

/// One run of one policy. Element k is the value after k steps; NaN after the end.
struct Takeover {
  int32_t steps = 0;     // driven steps; fewer than kTakeoverSteps after an infraction
  uint8_t ended_by = 0;  // Event bits
  // sight_step: first step at which no wall hides the place of TakeoverStart::user (which may be removed) from the
  // ego's front camera. input_step: first step with the user in the policy's images or vector observation. -1: none.
  int32_t sight_step = -1, input_step = -1;
  float sight_distance_m = std::numeric_limits<float>::quiet_NaN();  // at sight_step, between box centres
  std::array<float, kTakeoverSteps + 1> speed_mps, x_m, y_m;         // the ego's reference point

  Takeover() {
    for (auto* of_state : {&speed_mps, &x_m, &y_m}) of_state->fill(std::numeric_limits<float>::quiet_NaN());
  }
};

/// Runs takeovers in worlds of the probe's maps, with and without their walls.
class TakeoverWorlds {
 public:
  /// run.run() must be complete. sights: [maps]. All arguments must outlive the object.
  TakeoverWorlds(ProbeRun& run, const ProbeOptions& options, const std::vector<LineOfSight>& sights);
  ~TakeoverWorlds();

  /// takeovers_out: [starts, policies]. Each start has its own world without the removed agent. The policy drives the
  /// ego, with options.worlds.argmax. All other agents repeat the scene. sight_step considers the maps' walls even in
  /// worlds without walls. on_progress receives the completed fraction. Returns false after an interrupt; takeovers_out
  /// is then invalid.
  bool run(const std::vector<TakeoverStart>& starts, bool walls, const std::function<void(double)>& on_progress,
           std::vector<Takeover>* takeovers_out);

 private:
  struct Worlds;
  std::vector<GeometryHandle> handles_of(bool walls) const;
  Worlds* prepare(size_t policy, const std::vector<TakeoverStart>& starts, bool walls);
  void remove(Worlds* worlds, const std::vector<TakeoverStart>& starts);
  bool observe_step(Worlds* worlds, size_t policy, const std::vector<TakeoverStart>& starts, int step,
                    const std::vector<Takeover*>& runs);
  std::vector<int32_t> decide(Worlds* worlds, size_t policy, const std::vector<TakeoverStart>& starts, int step);

  ProbeRun& run_;
  const ProbeOptions& options_;
  const std::vector<LineOfSight>& sights_;
  CompiledMaps open_maps_;  // without walls
  // Key: whether worlds have walls, and whether the policy observes auxiliary slots, vectors and walls.
  std::map<std::array<bool, 4>, std::unique_ptr<Worlds>> worlds_;
};

}  // namespace pictura
