// The interface of the simulator: many worlds, each on one map, stepped together. Executors (`cpu`, `cuda`) are made by
// name and give bit-identical state. All arrays are indexed by slot: the controlled agents of world 0, then those of
// world 1, and so on. Spans lie in the memory of device(): what `cuda` returns is written by work on a stream.
#pragma once

#include <array>
#include <memory>
#include <string>
#include <string_view>
#include <vector>

#include "pictura/common/array.h"
#include "pictura/common/error_types.h"
#include "pictura/common/scene.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/command.h"
#include "pictura/simulator/compiled_map.h"
#include "pictura/simulator/conditioning.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/observation_query.h"
#include "pictura/simulator/rule_choices.h"
#include "pictura/simulator/simulator_arrays.h"
#include "pictura/simulator/state_edit.h"

namespace pictura {

constexpr int kMaxAgentsPerWorld = 4096;  // controlled, and as many parked cars
static_assert(2 * kMaxAgentsPerWorld <= kMaxBoxesPerWorld, "scenes hold whole worlds");
constexpr int kMaxSlots = 1 << 22;  // controlled agents of one simulator
constexpr int kMaxBoxes = 1 << 24;  // controlled agents and parked cars of one simulator; as many lights

/// The defaults are the paper's training world.
struct SimulatorConfig {
  uint64_t seed = 0;
  Device device;        // where the caller wants observations and scenes; `auto` chooses by it
  int num_threads = 0;  // host threads; 0: all
  float dt_s = 0.1f;    // in [0.01, 0.1]
  int episode_steps = 1280;
  float reset_inactive_fraction = 0.4f;  // a world resets when this part of its agents is inactive; > 1: never
  bool stagger_episodes = false;         // first episodes have lengths of their own, see max_steps_of()
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = false;  // whoever passes a goal within 2 m is absent for the rest of the episode
  float pedestrian_fraction = 0.1f, cyclist_fraction = 0.1f;  // of the agents; the rest are vehicles
  int parked_cars = 32;                                       // per episode and world
  bool walls = true;
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;  // where heads of lights are drawn; no rule reads it
  bool fixed_lights = false;                       // evaluation: 10/3/2 s; else timings are drawn per episode
  LightCycles light_cycles = LightCycles::phases;
  DynamicsRules dynamics{};
  OtherShares others{};
  bool auxiliary_observations = true;  // false: the auxiliary slots hold zeros (the like-for-like baseline)
  bool vector_observations = true;     // false: entity sets are not computed (perspective training)
  bool wall_observations = false;      // with them the set of walls, which is empty where walls are off
  std::array<ConditioningRange, kNumConditioning> conditioning = default_conditioning();

  static std::array<ConditioningRange, kNumConditioning> default_conditioning();
  /// Adds what another configuration observes.
  void observe_also(const SimulatorConfig& other) {
    vector_observations |= other.vector_observations;
    auxiliary_observations |= other.auxiliary_observations;
    wall_observations |= other.wall_observations;
  }
  bool observes(ObservationPart part) const {
    return part == ObservationPart::own ||
           (vector_observations && (part != ObservationPart::walls || wall_observations));
  }
};

/// Names as configuration files and options spell them, in the order of LightCycles.
constexpr const char* kLightCyclesNames[] = {"phases", "independent"};
constexpr const char* name_of(LightCycles cycles) { return kLightCyclesNames[static_cast<int>(cycles)]; }
/// The light cycles of a name of kLightCyclesNames. Throws UsageError listing the names.
LightCycles light_cycles_named(std::string_view name);

/// How the lights of a map in worlds of this configuration cycle: the name of its light cycles, "recorded" where the
/// map has a record of its lights, "none" where it has no lights.
std::string light_cycles_text(const SimulatorConfig& config, const CompiledMap& map);

/// One world: which of the simulator's maps it is on, and how many controlled agents are requested.
struct WorldSpec {
  int map = 0;
  int num_agents = 0;
  uint32_t global_world = 0;  // id across ranks, keys its random numbers
  friend bool operator==(const WorldSpec&, const WorldSpec&) = default;
};

/// World sizes drawn from U{min_agents, max_agents} until they fill num_slots exactly (the last is cut to fit); maps
/// are taken in turn. Throws UsageError unless 1 <= min <= max <= 4096 and num_slots >= 1.
std::vector<WorldSpec> draw_worlds(uint64_t seed, int num_slots, int min_agents, int max_agents, int num_maps);

/// How much a simulator has memory for.
struct SimulatorCapacity {
  int64_t worlds = 0, slots = 0;
  int64_t lights = 0;     // traffic lights of all worlds
  int64_t maps = 0;       // at once
  int64_t map_bytes = 0;  // of all maps' rules

  /// Controlled agents and parked cars.
  int64_t boxes(const SimulatorConfig& config) const { return slots + worlds * config.parked_cars; }
  bool holds(const SimulatorCapacity& other) const {
    return worlds >= other.worlds && slots >= other.slots && lights >= other.lights && maps >= other.maps &&
           map_bytes >= other.map_bytes;
  }
  /// The larger of both in everything.
  SimulatorCapacity joined(const SimulatorCapacity& other) const;
};

using CompiledMaps = std::vector<std::shared_ptr<const CompiledMap>>;

/// What these worlds on these maps take; the capacities of several batches of worlds can be joined.
SimulatorCapacity capacity_of(const CompiledMaps& maps, const std::vector<WorldSpec>& worlds);

/// What a simulator is made of: its configuration, its maps and its worlds on them.
struct SimulatorParts {
  SimulatorConfig config;
  CompiledMaps maps;
  std::vector<GeometryHandle> handles;  // [maps] by which the scene's worlds name them
  std::vector<WorldSpec> worlds;
};

/// A simulator's state, kept in its memory; made by Simulator::snapshot.
class StateSnapshot {
 public:
  virtual ~StateSnapshot() = default;
};

/// What became of the agents that were requested, over all worlds, in their current episodes.
struct SpawnReport {
  int64_t asked = 0, spawned = 0, refused = 0;      // asked == spawned + refused
  int64_t refused_no_place = 0, refused_taken = 0;  // the reasons: SpawnFailure of each absent agent
  int64_t entered = 0, left = 0;                    // on roads that end: lives after the first of a slot, and ended
  int64_t parked_asked = 0, parked_placed = 0;
};

/// An object serves one thread at a time; distinct objects are independent.
///
/// Addresses that a simulator gives last until reserve() or set_worlds() must grow what lies there; generation() counts
/// that. Lengths change with set_worlds().
///
/// A simulator on a CUDA device makes that device current in each call and restores the caller's. Its calls put work on
/// a stream and share the simulator's memory: put them on one stream, or make each wait for the one before. What is
/// wrong with commands is latched there: poll(), check() or the next call throws it.
class Simulator {
 public:
  virtual ~Simulator() = default;
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  std::string_view name() const { return name_; }
  const SimulatorConfig& config() const { return parts_->config; }
  const CompiledMaps& maps() const { return parts_->maps; }
  /// [maps] by which the scene's worlds name them: what maps()[i]->geometry is uploaded to in renderers.
  const std::vector<GeometryHandle>& handles() const { return parts_->handles; }
  const std::vector<WorldSpec>& worlds() const { return parts_->worlds; }

  /// All that the simulator shows; what controllers read.
  const SimulatorArrays& arrays() const { return arrays_; }
  /// Where commands are read from, and where results, observations, scenes and state lie.
  Device device() const { return arrays_.device; }
  int num_slots() const { return static_cast<int>(arrays_.slots.world_of_slot.size()); }
  /// Which agent of which world each slot is.
  const SlotTable& slots() const { return arrays_.slots; }
  const ObservationView& observations() const { return arrays_.observations; }
  const SceneBatch& scene() const { return arrays_.scene; }
  /// One view per slot. That of an absent agent (one that found no place to spawn) is at its map's origin and leaves
  /// nobody out: it can be drawn like any other, its images mean nothing, and its slot is never valid.
  Span<const View> views() const { return arrays_.views; }
  const AgentStateView& state() const { return arrays_.state; }
  Span<const int32_t> episode_step() const { return arrays_.episode_step; }
  Span<const int32_t> episode_index() const { return arrays_.episode_index; }
  Span<const uint8_t> episode_over() const { return arrays_.episode_over; }
  /// How often memory that callers hold addresses of has moved.
  uint64_t generation() const { return generation_; }

  /// Other worlds on other maps, at the start of their first episodes of `seed`: bit for bit what a new simulator of
  /// this configuration, seed, maps and worlds is. handles [maps], or empty for 0, 1, ... Memory is reused; on a device
  /// nothing is allocated where the capacity suffices, and maps that are there already are not copied again. Captured
  /// graphs and controllers of the worlds before are stale. May wait for the stream. Throws as make_simulator does,
  /// and then leaves everything as it was.
  virtual void set_worlds(CompiledMaps maps, std::vector<GeometryHandle> handles, std::vector<WorldSpec> worlds,
                          uint64_t seed, Stream stream = {}) = 0;
  /// Allocates for set_worlds() calls up to this capacity. The present state goes on, as after a
  /// restore(). May wait for the device.
  virtual void reserve(const SimulatorCapacity& capacity) = 0;

  /// Starts a new episode in every world (episode 0 of the seed) and writes observations and scene.
  void reset(Stream stream = {}) { reset_worlds({}, config().seed, stream); }
  /// The same in the worlds whose mask is not 0, which from now on draw their random numbers from `seed`: bit for bit
  /// what these worlds of a simulator of that seed are. The others stay as they are, and so do totals: episodes that
  /// are cut off are not counted. world_mask: u8 [worlds] on device(). Throws Error for another array. A CUDA graph can
  /// capture it.
  void reset(const Array& world_mask, uint64_t seed, Stream stream = {});

  /// Gives fields of chosen agents other values. slots: i32 [n] on device(), each once. fields: by their names in
  /// fields.h, of their types, [n] or [n, per agent], on device(). What follows from them is found anew: an agent's
  /// lane, its height (of the road on the level of z_m), its box, view and observation; an active one has no
  /// halt_reason, and who is given a place that its world had not found for it counts as spawned. The results of the
  /// last step stay. Throws Error, which leaves the state as it was, for other arrays, for fields that follow from
  /// others (see is_derived() in agent_state_arrays.h), and for slots and values that restore() would refuse; on a
  /// device the last are latched. There nothing waits, and a CUDA graph can capture it.
  void set_state(const Array& slots, Span<const NamedArray> fields, Stream stream = {});

  /// Writes what slots would observe if chosen boxes of their worlds were not there, and others were: a row of `out` a
  /// query. Partners alone differ; a query that hides and inserts nobody gets the bits of observations(). State,
  /// observations and results stay as they are. hidden: indices into scene().agents, as in SceneBatch::hidden_agents,
  /// so that one list serves views as well. out: arrays of [queries, rows, features], which may hold anything before,
  /// of the parts that the configuration observes; the others are empty. All spans lie on device(). Throws Error, and
  /// then writes nothing, for arrays of other lengths, more than 2^24 queries, and a query with a slot, ranges, a
  /// hidden box (one of another world) or an inserted one (numbers that are not finite) that cannot be; on a device
  /// faults of queries are latched. There partners, lanes, boundaries and walls begin at a multiple of 16 bytes,
  /// nothing allocates or waits, and a CUDA graph can capture it.
  void observe(Span<const ObservationQuery> queries, Span<const int32_t> hidden, Span<const InsertedBox> inserted,
               const ObservationView& out, Stream stream = {});

  /// Advances every world by one step. actions: i32 [slots] on device(), each in [0, kNumActions); those of inactive
  /// agents are ignored. A world whose last step ended its episode is reset instead, and its slots are not valid in
  /// that step (next-step autoreset). Throws Error, which leaves the state as it was, for another array, and for an
  /// action out of range; on a device the latter is latched. There a step allocates nothing and waits for nothing, and
  /// a CUDA graph can capture it.
  StepResult step(const Array& actions, Stream stream = {});
  /// The same by commands, [slots], see command.h: what a Controller writes. A step of actions alone gives the bits
  /// that the simple form gives.
  StepResult step(Span<const Command> commands, Stream stream = {});

  /// Throws Error when a step, an edit or a query was rejected since the last call that threw, as far as the host
  /// knows; does not wait.
  virtual void poll() {}
  /// Waits for the work on this stream, then polls.
  virtual void check(Stream /*stream*/ = {}) {}

  // On a device each of the following waits for the work on its stream and copies to the host.
  virtual SpawnReport spawn_report(Stream stream = {}) const = 0;
  virtual const SimulatorTotals& totals(Stream stream = {}) const = 0;
  /// Over every field of the state, the light states and the parked cars, in documented order; equal on every executor.
  virtual uint64_t state_hash(Stream stream = {}) const = 0;

  /// The whole state as bytes, for exact resume, and back. Throws Error when the bytes are of another configuration.
  virtual std::vector<uint8_t> save(Stream stream = {}) const = 0;
  virtual void restore(Span<const uint8_t> bytes, Stream stream = {}) = 0;

  /// A copy of the state in the simulator's own memory, and back: on a device restore() waits for nothing. Throws Error
  /// when the snapshot is of other worlds or another simulator.
  virtual std::unique_ptr<StateSnapshot> snapshot(Stream stream = {}) const = 0;
  virtual void restore(const StateSnapshot& snapshot, Stream stream = {}) = 0;

 protected:
  explicit Simulator(std::string_view name) : name_(name) {}

  // What an executor shows: its parts once, its arrays whenever it has other worlds or other memory.
  const SimulatorParts* parts_ = nullptr;
  SimulatorArrays arrays_;
  uint64_t generation_ = 0;

 private:
  // step() once it has checked everything but the values.
  virtual StepResult step_actions(Span<const int32_t> actions, Stream stream) = 0;
  virtual StepResult step_commands(Span<const Command> commands, Stream stream) = 0;
  // reset() and set_state() likewise. An empty mask: all worlds.
  virtual void reset_worlds(Span<const uint8_t> world_mask, uint64_t seed, Stream stream) = 0;
  virtual void apply_edit(const StateEdit& edit, Stream stream) = 0;
  // observe() likewise.
  virtual void answer_queries(const ObservationQueries& asked, Stream stream) = 0;

  std::string_view name_;
};

}  // namespace pictura
