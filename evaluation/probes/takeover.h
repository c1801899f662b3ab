// Takeovers: from a state of a driven scene, a policy drives an ego, while all other agents repeat their motion in that
// scene. Includes no torch headers.
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

/// Number of runs in every pass through a network. Each run has the same row in every pass, so that equal inputs give
/// bit-identical outputs.
constexpr int takeover_pass(Device device) { return device.is_host() ? 8 : 256; }

struct TakeoverStart {
  const DrivenScene* scene = nullptr;
  const SavedWorld* world = nullptr;  // the scene's world in the state at the takeover
  int32_t step = 0, ego = 0;          // step: steps done in the scenario at the takeover
  int32_t user = -1;                  // hidden vehicle; -1: none
  int32_t removed = -1;               // removed agent; -1: none
};

/// One run of one policy. Element k of an array is the value after k steps; NaN after the end of the run.
struct Takeover {
  int32_t steps = 0;     // steps that the ego drove: kTakeoverSteps, or fewer if an infraction ended the run
  uint8_t ended_by = 0;  // Event bits of the infraction that ended the run
  // sight_step: first step at which no wall of the map hides the user, or the place of a removed user, from the ego's
  // front camera. input_step: first step at which the user is in the policy's input: visible in cameras, or among the
  // nearest road users of a vector observation. Both are -1 if there is no such step.
  int32_t sight_step = -1, input_step = -1;
  float sight_distance_m = std::numeric_limits<float>::quiet_NaN();  // at sight_step, between the boxes' centres
  std::array<float, kTakeoverSteps + 1> speed_mps, x_m, y_m;         // motion of the ego's reference point

  Takeover() {
    for (auto* of_state : {&speed_mps, &x_m, &y_m}) of_state->fill(std::numeric_limits<float>::quiet_NaN());
  }
};

/// Runs takeovers in worlds of the probe's maps, with and without their walls.
class TakeoverWorlds {
 public:
  /// Creates the worlds. run.run() must have driven the scenes before. sights: [maps]. The arguments must outlive the
  /// object.
  TakeoverWorlds(ProbeRun& run, const ProbeOptions& options, const std::vector<LineOfSight>& sights);
  ~TakeoverWorlds();

  /// Runs all takeovers; takeovers_out: [starts, policies]. Each start has its own world, which continues from the
  /// state at the takeover without the removed agent. The policy drives the ego from its own input;
  /// options.worlds.argmax decides whether it takes the most likely action or draws one. All other agents are placed as
  /// in the scene. Sight is measured with the walls of the maps, even in worlds without walls. on_progress receives the
  /// completed fraction, which is above 0. Returns false after an interrupt; takeovers_out must not be used then.
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
  CompiledMaps open_maps_;  // maps without walls
  // Worlds by four properties: whether they have walls, and whether they observe auxiliary slots, entities, and walls.
  std::map<std::array<bool, 4>, std::unique_ptr<Worlds>> worlds_;
};

}  // namespace pictura
