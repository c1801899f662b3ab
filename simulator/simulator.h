// Interface of the simulator: many worlds, each on one map, stepped together. Executors (`cpu`, `cuda`) are made by
// name and give bit-identical states. All arrays are indexed by slot: the controlled agents of world 0, then those of
// world 1, and so on. Spans lie in the memory of device(): work on a stream writes the spans that `cuda` returns.
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

constexpr int kMaxAgentsPerWorld = 4096;  // controlled agents, and the same number of parked cars
static_assert(2 * kMaxAgentsPerWorld <= kMaxBoxesPerWorld, "scenes hold whole worlds");
constexpr int kMaxSlots = 1 << 22;  // controlled agents of one simulator
constexpr int kMaxBoxes = 1 << 24;  // agents and parked cars of one simulator; also the maximum number of lights

/// Configuration of a simulator. The defaults are the paper's training world.
struct SimulatorConfig {
  uint64_t seed = 0;
  Device device;        // device of observations and scenes; `auto` chooses the executor by it
  int num_threads = 0;  // host threads; 0: all
  float dt_s = 0.1f;    // in [0.01, 0.1]
  int episode_steps = 1280;
  float reset_inactive_fraction = 0.4f;  // a world resets when this share of its agents is inactive; > 1: never
  bool stagger_episodes = false;         // first episodes have individual lengths, see max_steps_of()
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = false;  // an agent that passes a goal within 2 m is absent for the rest of the episode
  float pedestrian_fraction = 0.1f, cyclist_fraction = 0.1f;  // shares of the agents; all others are vehicles
  int parked_cars = 32;                                       // per episode and world
  bool walls = true;
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;  // drawn positions of heads; rules do not read them
  bool fixed_lights = false;                       // evaluation: 10/3/2 s; else timings are drawn per episode
  LightCycles light_cycles = LightCycles::phases;
  DynamicsRules dynamics{};
  OtherShares others{};
  bool auxiliary_observations = true;  // false: the auxiliary slots hold zeros (the like-for-like baseline)
  bool vector_observations = true;     // false: entity sets are not computed (perspective training)
  bool wall_observations = false;      // whether sets of walls are observed; empty if walls are off
  std::array<ConditioningRange, kNumConditioning> conditioning = default_conditioning();

  static std::array<ConditioningRange, kNumConditioning> default_conditioning();
  /// Adds the observations of another configuration.
  void add_observations(const SimulatorConfig& other) {
    vector_observations |= other.vector_observations;
    auxiliary_observations |= other.auxiliary_observations;
    wall_observations |= other.wall_observations;
  }
  bool observes(ObservationPart part) const {
    return part == ObservationPart::own ||
           (vector_observations && (part != ObservationPart::walls || wall_observations));
  }
};

/// Names in configuration files and options, in the order of LightCycles.
constexpr const char* kLightCyclesNames[] = {"phases", "independent"};
constexpr const char* name_of(LightCycles cycles) { return kLightCyclesNames[static_cast<int>(cycles)]; }
/// Returns the light cycles with a name of kLightCyclesNames. Throws UsageError listing the names.
LightCycles light_cycles_named(std::string_view name);

/// Returns the type of light cycles of a map in worlds of this configuration: "recorded" if the map has recorded
/// lights, "none" if it has no lights, else the name of the configuration's light cycles.
std::string light_cycles_text(const SimulatorConfig& config, const CompiledMap& map);

/// One world: its map among the simulator's maps, and the requested number of controlled agents.
struct WorldSpec {
  int map = 0;
  int num_agents = 0;
  uint32_t global_world = 0;  // id across ranks; key of its random numbers
  friend bool operator==(const WorldSpec&, const WorldSpec&) = default;
};

/// Draws world sizes from U{min_agents, max_agents} until they fill num_slots exactly (the last is cut to fit); maps
/// are assigned in turn. Throws UsageError unless 1 <= min <= max <= 4096 and num_slots >= 1.
std::vector<WorldSpec> draw_worlds(uint64_t seed, int num_slots, int min_agents, int max_agents, int num_maps);

/// Sizes for which a simulator has memory.
struct SimulatorCapacity {
  int64_t worlds = 0, slots = 0;
  int64_t lights = 0;     // traffic lights of all worlds
  int64_t maps = 0;       // maps held at the same time
  int64_t map_bytes = 0;  // size of the data that rules read, for all maps

  /// Returns the number of controlled agents and parked cars.
  int64_t boxes(const SimulatorConfig& config) const { return slots + worlds * config.parked_cars; }
  bool holds(const SimulatorCapacity& other) const {
    return worlds >= other.worlds && slots >= other.slots && lights >= other.lights && maps >= other.maps &&
           map_bytes >= other.map_bytes;
  }
  /// Returns the maximum of both capacities in every member.
  SimulatorCapacity joined(const SimulatorCapacity& other) const;
};

using CompiledMaps = std::vector<std::shared_ptr<const CompiledMap>>;

/// Returns the capacity that these worlds on these maps need; capacities of several batches of worlds can be joined.
SimulatorCapacity capacity_of(const CompiledMaps& maps, const std::vector<WorldSpec>& worlds);

/// Parts of a simulator: its configuration, its maps and its worlds on these maps.
struct SimulatorParts {
  SimulatorConfig config;
  CompiledMaps maps;
  std::vector<GeometryHandle> handles;  // [maps] handles of the maps in the scene's worlds
  std::vector<WorldSpec> worlds;
};

/// A copy of a simulator's state in its own memory; made by Simulator::snapshot.
class StateSnapshot {
 public:
  virtual ~StateSnapshot() = default;
};

/// Outcome of the requested agents, over all worlds, in their current episodes.
struct SpawnReport {
  int64_t asked = 0, spawned = 0, refused = 0;      // asked == spawned + refused
  int64_t refused_no_place = 0, refused_taken = 0;  // the reasons: SpawnFailure of each absent agent
  int64_t entered = 0, left = 0;  // on roads that end: lives after the first of a slot, and lives that ended
  int64_t parked_asked = 0, parked_placed = 0;
};

/// Base class of simulators. An object serves one thread at a time; distinct objects are independent.
///
/// Addresses in a simulator stay valid until reserve() or set_worlds() must grow their arrays; generation() counts
/// these events. Lengths change with set_worlds().
///
/// A simulator on a CUDA device makes that device current in each call and restores the caller's device. Its calls put
/// work on a stream and share the simulator's memory: issue them on one stream, or make each call wait for the previous
/// one. Faults of commands are latched there: poll(), check() or the next call throws them.
class Simulator {
 public:
  virtual ~Simulator() = default;
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  std::string_view name() const { return name_; }
  const SimulatorConfig& config() const { return parts_->config; }
  const CompiledMaps& maps() const { return parts_->maps; }
  /// [maps] handles by which the scene's worlds refer to maps: renderers upload maps()[i]->geometry to these handles.
  const std::vector<GeometryHandle>& handles() const { return parts_->handles; }
  const std::vector<WorldSpec>& worlds() const { return parts_->worlds; }

  /// All arrays of the simulator; the input of controllers.
  const SimulatorArrays& arrays() const { return arrays_; }
  /// Device from which commands are read, and of results, observations, scenes and state.
  Device device() const { return arrays_.device; }
  int num_slots() const { return static_cast<int>(arrays_.slots.world_of_slot.size()); }
  /// World and agent of each slot.
  const SlotTable& slots() const { return arrays_.slots; }
  const ObservationView& observations() const { return arrays_.observations; }
  const SceneBatch& scene() const { return arrays_.scene; }
  /// One view per slot. The view of an absent agent (which found no place to spawn) is at its map's origin and excludes
  /// no agent. It can be drawn like any other view, but its images have no meaning, and its slot is never valid.
  Span<const View> views() const { return arrays_.views; }
  const AgentStateView& state() const { return arrays_.state; }
  Span<const int32_t> episode_step() const { return arrays_.episode_step; }
  Span<const int32_t> episode_index() const { return arrays_.episode_index; }
  Span<const uint8_t> episode_over() const { return arrays_.episode_over; }
  /// Number of times that memory with addresses known to callers has moved.
  uint64_t generation() const { return generation_; }

  /// Replaces the worlds and maps, at the start of the first episodes of `seed`: bit for bit as in a new simulator of
  /// this configuration, seed, maps and worlds. handles [maps], or empty for 0, 1, ... Memory is reused; on a device,
  /// nothing is allocated if the capacity suffices, and maps that are already present are not copied again. Captured
  /// graphs and controllers of the previous worlds become stale. May wait for the stream. Throws as make_simulator
  /// does, and then leaves everything unchanged.
  virtual void set_worlds(CompiledMaps maps, std::vector<GeometryHandle> handles, std::vector<WorldSpec> worlds,
                          uint64_t seed, Stream stream = {}) = 0;
  /// Allocates for set_worlds() calls up to this capacity. The current state continues, as after a restore(). May wait
  /// for the device.
  virtual void reserve(const SimulatorCapacity& capacity) = 0;

  /// Starts a new episode in every world (episode 0 of the seed) and writes observations and scene.
  void reset(Stream stream = {}) { reset_worlds({}, config().seed, stream); }
  /// Starts a new episode in the worlds with a nonzero mask, which from now on draw their random numbers from `seed`:
  /// bit for bit as in these worlds of a simulator of that seed. The other worlds and all totals stay unchanged:
  /// cut-off episodes are not counted. world_mask: u8 [worlds] on device(). Throws Error for another array. A CUDA
  /// graph can capture the call.
  void reset(const Array& world_mask, uint64_t seed, Stream stream = {});

  /// Sets fields of chosen agents. slots: i32 [n] on device(), each at most once. fields: by their names in fields.h,
  /// of their types, [n] or [n, per agent], on device(). Dependent values are recomputed: an agent's lane, its height
  /// (of the road on the level of z_m), its box, view and observation. An active agent gets no halt_reason, and an
  /// agent that gets a place after it found none counts as spawned. The results of the last step remain unchanged.
  /// Throws Error, leaving the state unchanged, for other arrays, for dependent fields (see is_derived() in
  /// agent_state_arrays.h), and for slots and values that restore() would refuse; on a device, faults of slots and
  /// values are latched. On a device the call does not wait, and a CUDA graph can capture it.
  void set_state(const Array& slots, Span<const NamedArray> fields, Stream stream = {});

  /// Writes the observations that slots would have without some boxes of their worlds and with additional boxes: one
  /// row of `out` per query. Only partners differ; a query without hidden and inserted boxes gets the bits of
  /// observations(). State, observations and results stay unchanged. hidden: indices into scene().agents, as in
  /// SceneBatch::hidden_agents, so that one list serves views as well. out: arrays of [queries, rows, features] with
  /// any previous values, of the parts that the configuration observes; the other arrays are empty. All spans lie on
  /// device(). Throws Error, without writing, for arrays of other lengths, for more than 2^24 queries, and for invalid
  /// queries. A query is invalid if its slot or ranges are, if a hidden box is in another world, or if an inserted box
  /// has numbers that are not finite. On a device, faults of queries are latched, and partners, lanes, boundaries and
  /// walls must begin at a multiple of 16 bytes. There the call neither allocates nor waits, and a CUDA graph can
  /// capture it.
  void observe(Span<const ObservationQuery> queries, Span<const int32_t> hidden, Span<const InsertedBox> inserted,
               const ObservationView& out, Stream stream = {});

  /// Advances every world by one step. actions: i32 [slots] on device(), each in [0, kNumActions); actions of inactive
  /// agents are ignored. A world whose last step ended its episode is reset instead, and its slots are not valid in
  /// that step (next-step autoreset). Throws Error, leaving the state unchanged, for another array, and for an action
  /// out of range; on a device, an error of an action is latched. On a device a step neither allocates nor waits, and a
  /// CUDA graph can capture it.
  StepResult step(const Array& actions, Stream stream = {});
  /// Advances every world by commands, [slots], as a Controller writes them; see command.h. Commands that are actions
  /// alone give the same bits as the overload for actions.
  StepResult step(Span<const Command> commands, Stream stream = {});

  /// Throws Error when a step, an edit or a query was rejected since the last call that threw, as far as the host
  /// knows. Does not wait.
  virtual void poll() {}
  /// Waits for the work on this stream, then polls.
  virtual void check(Stream /*stream*/ = {}) {}

  // On a device, each of the following waits for the work on its stream and copies to the host.
  virtual SpawnReport spawn_report(Stream stream = {}) const = 0;
  virtual const SimulatorTotals& totals(Stream stream = {}) const = 0;
  /// Hash of every field of the state, the light states and the parked cars, in documented order; equal on all
  /// executors.
  virtual uint64_t state_hash(Stream stream = {}) const = 0;

  /// Save and restore the whole state as bytes, for exact resume. Throws Error when the bytes are of another
  /// configuration.
  virtual std::vector<uint8_t> save(Stream stream = {}) const = 0;
  virtual void restore(Span<const uint8_t> bytes, Stream stream = {}) = 0;

  /// Copy the state in the simulator's own memory, and restore it: on a device restore() does not wait. Throws Error
  /// when the snapshot is of other worlds or another simulator.
  virtual std::unique_ptr<StateSnapshot> snapshot(Stream stream = {}) const = 0;
  virtual void restore(const StateSnapshot& snapshot, Stream stream = {}) = 0;

 protected:
  explicit Simulator(std::string_view name) : name_(name) {}

  // Data that an executor sets: its parts once, its arrays whenever it has other worlds or other memory.
  const SimulatorParts* parts_ = nullptr;
  SimulatorArrays arrays_;
  uint64_t generation_ = 0;

 private:
  // Implementation of step() after all checks except those of values.
  virtual StepResult step_actions(Span<const int32_t> actions, Stream stream) = 0;
  virtual StepResult step_commands(Span<const Command> commands, Stream stream) = 0;
  // Implementations of reset() and set_state() after their checks of arrays. An empty mask: all worlds.
  virtual void reset_worlds(Span<const uint8_t> world_mask, uint64_t seed, Stream stream) = 0;
  virtual void apply_edit(const StateEdit& edit, Stream stream) = 0;
  // Implementation of observe() after its checks of arrays.
  virtual void answer_queries(const ObservationQueries& asked, Stream stream) = 0;

  std::string_view name_;
};

}  // namespace pictura
