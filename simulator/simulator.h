// Interface of the simulator. It steps many worlds together, each on one map. Its implementations, the executors `cpu`
// and `cuda`, give bit-identical states; make_simulator() makes an executor by name. Arrays are indexed by slot: first
// the slots of world 0's controlled agents, then those of world 1, and so on. Spans point to memory of device(); for
// `cuda`, work on a stream writes this memory.
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

constexpr int kMaxAgentsPerWorld = 4096;  // maximum number of controlled agents, and of parked cars
static_assert(2 * kMaxAgentsPerWorld <= kMaxBoxesPerWorld, "scenes hold whole worlds");
constexpr int kMaxSlots = 1 << 22;  // controlled agents of one simulator
constexpr int kMaxBoxes = 1 << 24;  // agents and parked cars of one simulator; the same limit holds for its lights

/// Configuration of a simulator. The defaults are those of the paper's training.
struct SimulatorConfig {
  uint64_t seed = 0;
  Device device;        // device of observations and scenes; `auto` selects an executor for this device
  int num_threads = 0;  // host threads; 0: all
  float dt_s = 0.1f;    // in [0.01, 0.1]
  int episode_steps = 1280;
  float reset_inactive_fraction = 0.4f;  // a world resets when this share of its agents is inactive; > 1: never
  bool stagger_episodes = false;         // whether the first episodes of worlds have random lengths, see max_steps_of()
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = false;  // whether agents become absent after they pass a goal within 2 m
  float pedestrian_fraction = 0.1f, cyclist_fraction = 0.1f;  // shares of the agents; all others are vehicles
  int parked_cars = 32;                                       // number per world; each episode places them again
  bool walls = true;
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;  // where light heads are drawn; agents' rules ignore it
  bool fixed_lights = false;                       // whether green, yellow and all-red last 10, 3 and 2 s, as in
                                                   // evaluations; else durations are random
  LightCycles light_cycles = LightCycles::phases;
  DynamicsRules dynamics{};
  OtherShares others{};
  bool auxiliary_observations = true;  // false: auxiliary features are zeros
  bool vector_observations = true;     // false: no entity sets, as in training from images
  bool wall_observations = false;      // whether walls are observed; no rows if `walls` is false
  std::array<ConditioningRange, kNumConditioning> conditioning = default_conditioning();

  static std::array<ConditioningRange, kNumConditioning> default_conditioning();
  /// Enables, in addition, all observations that another configuration enables.
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

/// Names of LightCycles in configuration files and options, in the order of the enumerators.
constexpr const char* kLightCyclesNames[] = {"phases", "independent"};
constexpr const char* name_of(LightCycles cycles) { return kLightCyclesNames[static_cast<int>(cycles)]; }
/// Returns the light cycles with a name of kLightCyclesNames. Throws UsageError, which lists the names, for another
/// name.
LightCycles light_cycles_named(std::string_view name);

/// Returns a text on the light cycles of a map in worlds of this configuration: "none" if the map has no lights,
/// "recorded" if it has recorded lights, else the name of config.light_cycles.
std::string light_cycles_text(const SimulatorConfig& config, const CompiledMap& map);

/// One world: the index of its map among the simulator's maps, and the requested number of controlled agents.
struct WorldSpec {
  int map = 0;
  int num_agents = 0;
  uint32_t global_world = 0;  // id that is unique across ranks; a key of the world's random numbers
  friend bool operator==(const WorldSpec&, const WorldSpec&) = default;
};

/// Draws sizes of worlds from U{min_agents, ..., max_agents} until they fill num_slots; the last world is made smaller
/// to fit. Worlds get the maps in turn. Throws UsageError unless 1 <= min_agents <= max_agents <= 4096 and num_slots >=
/// 1.
std::vector<WorldSpec> draw_worlds(uint64_t seed, int num_slots, int min_agents, int max_agents, int num_maps);

/// Maximum sizes for which a simulator has allocated memory.
struct SimulatorCapacity {
  int64_t worlds = 0, slots = 0;
  int64_t lights = 0;     // traffic lights of all worlds
  int64_t maps = 0;       // maps held at the same time
  int64_t map_bytes = 0;  // sum of MapRules::size_bytes() over the maps

  /// Returns the number of controlled agents and parked cars.
  int64_t boxes(const SimulatorConfig& config) const { return slots + worlds * config.parked_cars; }
  bool holds(const SimulatorCapacity& other) const {
    return worlds >= other.worlds && slots >= other.slots && lights >= other.lights && maps >= other.maps &&
           map_bytes >= other.map_bytes;
  }
  /// Returns, for every member, the maximum of both capacities.
  SimulatorCapacity joined(const SimulatorCapacity& other) const;
};

using CompiledMaps = std::vector<std::shared_ptr<const CompiledMap>>;

/// Returns the capacity that these worlds on these maps need. SimulatorCapacity::joined() combines the capacities of
/// several batches of worlds.
SimulatorCapacity capacity_of(const CompiledMaps& maps, const std::vector<WorldSpec>& worlds);

/// Parts of a simulator: its configuration, its maps and its worlds on these maps.
struct SimulatorParts {
  SimulatorConfig config;
  CompiledMaps maps;
  std::vector<GeometryHandle> handles;  // [maps] handles by which scenes refer to the maps
  std::vector<WorldSpec> worlds;
};

/// A copy of a simulator's state, kept in the memory of the simulator's device; see Simulator::snapshot().
class StateSnapshot {
 public:
  virtual ~StateSnapshot() = default;
};

/// Numbers of requested and placed agents in the current episodes of all worlds.
struct SpawnReport {
  int64_t asked = 0, spawned = 0, refused = 0;      // asked == spawned + refused
  int64_t refused_no_place = 0, refused_taken = 0;  // `refused`, split by SpawnFailure
  int64_t entered = 0, left = 0;                    // on roads that end: numbers of later entries, and of departures
  int64_t parked_asked = 0, parked_placed = 0;
};

/// Base class of simulators. Only one thread may use an object at a time; distinct objects are independent.
///
/// Addresses of arrays stay valid until reserve() or set_worlds() must enlarge the arrays; generation() counts these
/// enlargements. Lengths of arrays change with set_worlds().
///
/// A simulator on a CUDA device makes that device current in each call and restores the caller's device. Its calls put
/// work on a stream and share the simulator's memory: issue them on one stream, or make each call wait for the previous
/// one. Invalid commands are found only on the device, which stores the error; poll(), check() or the next call throws
/// it.
class Simulator {
 public:
  virtual ~Simulator() = default;
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  std::string_view name() const { return name_; }
  const SimulatorConfig& config() const { return parts_->config; }
  const CompiledMaps& maps() const { return parts_->maps; }
  /// [maps] handles by which the scene refers to maps. Before a renderer draws the scene, upload maps()[i]->geometry
  /// with handles()[i].
  const std::vector<GeometryHandle>& handles() const { return parts_->handles; }
  const std::vector<WorldSpec>& worlds() const { return parts_->worlds; }

  /// All arrays of the simulator; the input of controllers.
  const SimulatorArrays& arrays() const { return arrays_; }
  /// Device whose memory holds the commands, results, observations, scenes and state.
  Device device() const { return arrays_.device; }
  int num_slots() const { return static_cast<int>(arrays_.slots.world_of_slot.size()); }
  /// World and agent of each slot.
  const SlotTable& slots() const { return arrays_.slots; }
  const ObservationView& observations() const { return arrays_.observations; }
  const SceneBatch& scene() const { return arrays_.scene; }
  /// One view per slot. The view of an absent agent is at the map's origin and has no ego, so no box is omitted. It can
  /// be drawn like any other view, but its images have no meaning, and its slot is never valid.
  Span<const View> views() const { return arrays_.views; }
  const AgentStateView& state() const { return arrays_.state; }
  Span<const int32_t> episode_step() const { return arrays_.episode_step; }
  Span<const int32_t> episode_index() const { return arrays_.episode_index; }
  Span<const uint8_t> episode_over() const { return arrays_.episode_over; }
  /// Number of times that arrays have moved in memory, so that addresses known to callers became invalid.
  uint64_t generation() const { return generation_; }

  /// Replaces the worlds and maps, and starts the first episodes of `seed`. The result is bit for bit that of a new
  /// simulator with this configuration, seed, maps and worlds. handles: [maps]; empty means 0, 1, and so on. Memory is
  /// reused: on a device, nothing is allocated if the capacity suffices, and maps that are already present are not
  /// copied again. Captured graphs and controllers of the previous worlds must no longer be used. May wait for the
  /// stream. Throws as make_simulator() does, and then leaves everything unchanged.
  virtual void set_worlds(CompiledMaps maps, std::vector<GeometryHandle> handles, std::vector<WorldSpec> worlds,
                          uint64_t seed, Stream stream = {}) = 0;
  /// Allocates memory for later set_worlds() calls up to this capacity. The current state is preserved. May wait for
  /// the device.
  virtual void reserve(const SimulatorCapacity& capacity) = 0;

  /// Starts episode 0 of the configuration's seed in every world and writes observations and scene.
  void reset(Stream stream = {}) { reset_worlds({}, config().seed, stream); }
  /// Starts episode 0 of `seed` in the worlds with a nonzero mask. From now on these worlds draw their random numbers
  /// from `seed`, bit for bit as in a simulator of that seed. The other worlds and all totals stay unchanged, because
  /// interrupted episodes are not counted. world_mask: u8 [worlds] on device(). Throws Error for another type, shape or
  /// device. A CUDA graph can capture the call.
  void reset(const Array& world_mask, uint64_t seed, Stream stream = {});

  /// Sets fields of chosen agents. slots: i32 [n] on device(), all different. fields: arrays on device() with the names
  /// and types of fields.h, [n] or [n, per agent]. Derived values are recomputed: an agent's lane, its height (that of
  /// the road on the level of z_m), its box, view and observation. The halt_reason of an active agent becomes 0. An
  /// agent that found no place and now gets one counts as spawned. The results of the last step remain unchanged.
  /// Throws Error, leaving the state unchanged, for other names, types, shapes or devices, for derived fields (see
  /// is_derived() in agent_state_arrays.h), and for invalid slots and values. On a device, poll(), check() or the next
  /// call throws the errors of slots and values. There the call does not wait, and a CUDA graph can capture it.
  void set_state(const Array& slots, Span<const NamedArray> fields, Stream stream = {});

  /// Writes hypothetical observations: those that slots would have if some boxes were hidden and other boxes inserted.
  /// Query i writes row i of `out`. Only the partners (observed road users) can differ from those of observations().
  /// State, observations() and results stay unchanged. hidden: indices into scene().agents, as in
  /// SceneBatch::hidden_agents, so that the same list can be used for views. out: one array [queries, rows, features]
  /// for each array that the simulator observes; all others are empty. All spans must be in memory of device(). Throws
  /// Error, without writing, for arrays of other lengths, for more than 2^24 queries, and for invalid queries. A query
  /// is invalid if its slot or a range is out of bounds, if a hidden box is in another world, or if an inserted box has
  /// numbers that are not finite. On a device, poll(), check() or the next call throws the errors of queries. There,
  /// partners, lanes, boundaries and walls must begin at a multiple of 16 bytes; the call neither allocates nor waits,
  /// and a CUDA graph can capture it.
  void observe(Span<const ObservationQuery> queries, Span<const int32_t> hidden, Span<const InsertedBox> inserted,
               const ObservationView& out, Stream stream = {});

  /// Advances every world by one step. actions: i32 [slots] on device(), each in [0, kNumActions); actions of inactive
  /// agents are ignored. If the last step ended the episode of a world, this step resets the world instead, and its
  /// slots are not valid in this step (next-step autoreset). Throws Error, leaving the state unchanged, for an array of
  /// another type, shape or device, and for an action out of range. On a device, poll(), check() or the next call
  /// throws the error of an action. There a step neither allocates nor waits, and a CUDA graph can capture it.
  StepResult step(const Array& actions, Stream stream = {});
  /// Advances every world by one step with commands [slots]; see command.h. If all commands are actions, the result is
  /// bit for bit that of the overload for actions.
  StepResult step(Span<const Command> commands, Stream stream = {});

  /// Throws Error if the host already knows that a step, set_state() or observe() was rejected since the last Error.
  /// Does not wait.
  virtual void poll() {}
  /// Waits for the work on this stream, then calls poll().
  virtual void check(Stream /*stream*/ = {}) {}

  // On a device, each of the following functions waits for the work on its stream and copies to the host.
  virtual SpawnReport spawn_report(Stream stream = {}) const = 0;
  virtual const SimulatorTotals& totals(Stream stream = {}) const = 0;
  /// Hash of the agents' fields, the light states and the parked cars; equal on all executors.
  virtual uint64_t state_hash(Stream stream = {}) const = 0;

  /// Save and restore the whole state as bytes, to resume exactly. restore() throws Error if the bytes come from a
  /// simulator with another configuration.
  virtual std::vector<uint8_t> save(Stream stream = {}) const = 0;
  virtual void restore(Span<const uint8_t> bytes, Stream stream = {}) = 0;

  /// Copy the state within the memory of device(), and restore it. On a device, restore() does not wait. restore()
  /// throws Error if the snapshot comes from other worlds or from another simulator.
  virtual std::unique_ptr<StateSnapshot> snapshot(Stream stream = {}) const = 0;
  virtual void restore(const StateSnapshot& snapshot, Stream stream = {}) = 0;

 protected:
  explicit Simulator(std::string_view name) : name_(name) {}

  // Executors set parts_ once, and arrays_ whenever their worlds or the addresses of arrays change.
  const SimulatorParts* parts_ = nullptr;
  SimulatorArrays arrays_;
  uint64_t generation_ = 0;

 private:
  // Implementations of step(). The caller has checked types, shapes and devices, but not values.
  virtual StepResult step_actions(Span<const int32_t> actions, Stream stream) = 0;
  virtual StepResult step_commands(Span<const Command> commands, Stream stream) = 0;
  // Implementations of reset() and set_state(). The caller has checked the arrays. An empty mask means all worlds.
  virtual void reset_worlds(Span<const uint8_t> world_mask, uint64_t seed, Stream stream) = 0;
  virtual void apply_edit(const StateEdit& edit, Stream stream) = 0;
  // Implementation of observe(). The caller has checked the arrays.
  virtual void answer_queries(const ObservationQueries& asked, Stream stream) = 0;

  std::string_view name_;
};

}  // namespace pictura
