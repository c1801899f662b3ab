// Policies that drive on from a state of a driven scene while all others do what they did in it. Without torch headers.
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

/// Runs that go through a network at once, always, each at its place: equal inputs give equal bits.
constexpr int takeover_pass(Device device) { return device.is_host() ? 8 : 256; }

struct TakeoverStart {
  const DrivenScene* scene = nullptr;
  const KeptWorld* world = nullptr;  // the scene's, in the state in which the policy takes over
  int32_t step = 0, ego = 0;         // steps done in the scenario when the policy takes over
  int32_t user = -1;                 // whom the ego cannot see; -1: nobody
  int32_t removed = -1;              // who is not there; -1: nobody
};

/// One run of one policy. What has an index k is after k steps; NaN once the run has ended.
struct Takeover {
  int32_t steps = 0;     // that the ego drove: kTakeoverSteps, or fewer where an infraction ended the run
  uint8_t ended_by = 0;  // Event bits of that
  // The first state in which no wall of the map is between the ego's eye and the user, or where it would be; and the
  // first in which the user is in what the policy reads: seen by cameras, or among the nearest partners. -1: never.
  int32_t sight_step = -1, input_step = -1;
  float sight_distance_m = std::numeric_limits<float>::quiet_NaN();  // between the boxes' centres, then
  std::array<float, kTakeoverSteps + 1> speed_mps, x_m, y_m;         // of its reference point

  Takeover() {
    for (auto* of_state : {&speed_mps, &x_m, &y_m}) of_state->fill(std::numeric_limits<float>::quiet_NaN());
  }
};

/// Runs takeovers in worlds of the probe's maps, with their walls and without them.
class TakeoverWorlds {
 public:
  /// After run.run(), which drives the scenes. sights: [maps]. All must outlive it.
  TakeoverWorlds(ProbeRun& run, const ProbeOptions& options, const std::vector<LineOfSight>& sights);
  ~TakeoverWorlds();

  /// [starts, policies] Each start is a world of its own that goes on from the state that was kept, without whoever is
  /// removed: all others are put where they were, and the policy drives the ego by what it reads, the most likely
  /// action or a draw. Sight is measured by the walls of the maps also where worlds have none. on_progress is told
  /// which part of it is done, above 0. Returns false on ^C, with nothing to be used.
  bool run(const std::vector<TakeoverStart>& starts, bool walls, const std::function<void(double)>& on_progress,
           std::vector<Takeover>* takeovers_out);

 private:
  struct Worlds;
  std::vector<GeometryHandle> handles_of(bool walls) const;
  Worlds* prepare(size_t policy, const std::vector<TakeoverStart>& starts, bool walls);
  void remove(Worlds* worlds, const std::vector<TakeoverStart>& starts);
  bool look(Worlds* worlds, size_t policy, const std::vector<TakeoverStart>& starts, int step,
            const std::vector<Takeover*>& runs);
  std::vector<int32_t> decide(Worlds* worlds, size_t policy, const std::vector<TakeoverStart>& starts, int step);

  ProbeRun& run_;
  const ProbeOptions& options_;
  const std::vector<LineOfSight>& sights_;
  CompiledMaps open_maps_;  // the same without walls
  // By walls, and by what is observed: auxiliary slots, entities, walls.
  std::map<std::array<bool, 4>, std::unique_ptr<Worlds>> worlds_;
};

}  // namespace pictura
