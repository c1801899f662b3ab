// The interface of the simulator: many worlds, each on one map, stepped together. Executors (`cpu`, `cuda`) are made by
// name and give bit-identical state. All arrays are indexed by slot: the controlled agents of world 0, then those of
// world 1, and so on. Spans lie in the memory of space(): what `cuda` returns is written by work on a stream.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/scene.h"
#include "pictura/map/map_geometry.h"
#include "pictura/map/road_map.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/fields.h"
#include "pictura/simulator/observation.h"
#include "pictura/simulator/totals.h"

namespace pictura {

constexpr int kMaxAgentsPerWorld = 4096;  // controlled, and as many parked cars
static_assert(2 * kMaxAgentsPerWorld <= kMaxBoxesPerWorld, "scenes hold whole worlds");
constexpr int kMaxSlots = 1 << 22;  // controlled agents of one simulator
constexpr int kMaxBoxes = 1 << 24;  // controlled agents and parked cars of one simulator; as many lights

/// The defaults are the paper's training world.
struct SimulatorConfig {
  uint64_t seed = 0;
  MemorySpace space = MemorySpace::host;  // where the caller wants observations and scenes; `auto` chooses by it
  int num_threads = 0;                    // host threads; 0: all
  float dt_s = 0.1f;                      // in [0.01, 0.1]
  int episode_steps = 1280;
  float reset_inactive_fraction = 0.4f;  // a world resets when this part of its agents is inactive; > 1: never
  float pedestrian_fraction = 0.1f, cyclist_fraction = 0.1f;  // of the agents; the rest are vehicles
  int parked_cars = 32;                                       // per episode and world
  bool walls = true;
  uint64_t wall_seed = 0;
  bool fixed_lights = false;           // evaluation: 10/3/2 s; else timings are drawn per episode
  bool auxiliary_observations = true;  // false: the auxiliary slots hold zeros (the like-for-like baseline)
  bool vector_observations = true;     // false: entity sets are not computed (perspective training)
  bool wall_observations = false;      // with them the set of walls, which is empty where walls are off
  std::array<ConditioningRange, kNumConditioning> conditioning = default_conditioning();

  static std::array<ConditioningRange, kNumConditioning> default_conditioning();
  bool observes(ObservationPart part) const {
    return part == ObservationPart::own ||
           (vector_observations && (part != ObservationPart::walls || wall_observations));
  }
};

/// One world: which of the simulator's maps it is on, and how many controlled agents it asks for.
struct WorldSpec {
  int map = 0;
  int num_agents = 0;
  uint32_t global_world = 0;  // id across ranks, keys its random numbers
};

/// World sizes drawn from U{min_agents, max_agents} until they fill num_slots exactly (the last is cut to fit); maps
/// are taken in turn. Throws UsageError unless 1 <= min <= max <= 4096 and num_slots >= 1.
std::vector<WorldSpec> draw_worlds(uint64_t seed, int num_slots, int min_agents, int max_agents, int num_maps);

/// What step() returns besides observations. Spans stay at one address for the life of the simulator.
struct StepResult {
  Span<const float> reward;        // [slots]
  Span<const uint8_t> terminated;  // [slots] 1: an infraction ended the agent's episode in this step
  Span<const uint8_t> truncated;   // [slots] 1: the episode ended for another reason; bootstrap
  Span<const uint8_t> valid;       // [slots] 1: the agent was active when the step began: learn from it
  Span<const uint8_t> refusal;     // [slots] SpawnFailure: why the agent is absent from this episode, 0 where it is not
};

/// What became of the agents that were asked for, over all worlds, in their current episodes.
struct SpawnReport {
  int64_t asked = 0, spawned = 0, refused = 0;      // asked == spawned + refused
  int64_t refused_no_place = 0, refused_taken = 0;  // the reasons: SpawnFailure of each absent agent
  int64_t parked_asked = 0, parked_placed = 0;
};

class Simulator {
 public:
  virtual ~Simulator() = default;
  Simulator() = default;
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  virtual std::string_view name() const = 0;
  /// Where actions are read from, and where results, observations, scenes and state lie.
  virtual MemorySpace space() const = 0;
  virtual const SimulatorConfig& config() const = 0;
  virtual const std::vector<std::shared_ptr<const RoadMap>>& maps() const = 0;
  virtual const std::vector<WorldSpec>& worlds() const = 0;
  virtual int num_slots() const = 0;

  /// Starts a new episode in every world (episode 0 of the seed) and writes observations and scene.
  virtual void reset(Stream stream = {}) = 0;

  /// Advances every world by one step. actions: [slots], each in [0, kNumActions); those of inactive agents are
  /// ignored. A world whose last step ended its episode is reset instead, and its slots are not valid in that step
  /// (next-step autoreset). Throws Error on an action out of range, which leaves the state as it was; on a device the
  /// next call, or check(), throws it. There a step allocates nothing and waits for nothing, and a CUDA graph can
  /// capture it.
  virtual StepResult step(Span<const int32_t> actions, Stream stream = {}) = 0;
  /// The same by commands, [slots], see command.h: what a Controller writes. A step of actions alone gives the bits
  /// that the simple form gives.
  virtual StepResult step(Span<const Command> commands, Stream stream = {}) = 0;

  /// Waits until everything asked for is done; throws Error when a step was refused since the last call that threw.
  virtual void check() = 0;

  /// Of the state after the last reset() or step().
  virtual ObservationView observations() = 0;
  /// The scene of all worlds: controlled agents in slot order, each world's parked cars after its controlled agents.
  virtual const SceneBatch& scene() = 0;
  /// One view per slot. That of an absent agent (one that found no place to spawn) stands at its map's origin and
  /// leaves nobody out: it can be drawn like any other, its images mean nothing, and its slot is never valid.
  virtual Span<const View> views() = 0;
  /// One per map, in the order of maps(), for Renderer::upload; its handle must equal the map's index.
  virtual std::vector<StaticGeometry> geometries() const = 0;

  /// What controllers read: all of the above, and which agent each slot is.
  virtual ControllerInput controller_input() = 0;

  virtual AgentStateView state() = 0;
  /// Steps done in the current episode of each world, and the number of that episode.
  virtual Span<const int32_t> episode_step() const = 0;
  virtual Span<const int32_t> episode_index() const = 0;

  // On a device each of the following waits until everything asked for is done, and copies to the host.
  virtual SpawnReport spawn_report() const = 0;
  virtual const SimulatorTotals& totals() const = 0;
  /// Over every field of the state, the light states and the parked cars, in documented order; equal on every executor.
  virtual uint64_t state_hash() const = 0;

  /// The whole state as bytes, for exact resume, and back. Throws Error when the bytes are of another configuration.
  virtual std::vector<uint8_t> save() const = 0;
  virtual void restore(Span<const uint8_t> bytes) = 0;
};

}  // namespace pictura
