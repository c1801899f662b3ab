// Interface of the simulator, which steps many worlds together, each on one map. The executors `cpu` and `cuda` give
// bit-identical states; make_simulator() makes them. Arrays are indexed by slot: first the controlled agents of world
// 0, then those of world 1, and so on.
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

constexpr int kMaxAgentsPerWorld = 4096;  // controlled agents; also maximum number of parked cars
static_assert(2 * kMaxAgentsPerWorld <= kMaxBoxesPerWorld, "scenes hold whole worlds");
constexpr int kMaxSlots = 1 << 22;  // controlled agents
constexpr int kMaxBoxes = 1 << 24;  // agents and parked cars; also maximum number of lights

/// Defaults are those of the paper's training.
struct SimulatorConfig {
  uint64_t seed = 0;
  Device device;        // for observations and scenes; make_simulator("auto") chooses the executor by it
  int num_threads = 0;  // on the host; 0: all
  float dt_s = 0.1f;    // in [0.01, 0.1]
  int episode_steps = 1280;
  float reset_inactive_fraction = 0.4f;  // inactive share at which a world resets; > 1: never
  bool stagger_episodes = false;         // random lengths of episodes; see max_steps_of()
  AfterInfraction after_infraction = AfterInfraction::halt;
  bool leave_at_goal = false;                                 // agents leave after they pass a goal within 2 m
  float pedestrian_fraction = 0.1f, cyclist_fraction = 0.1f;  // all others are vehicles
  int parked_cars = 32;                                       // per world, placed again in each episode
  bool walls = true;
  uint64_t wall_seed = 0;
  LightHeads light_heads = LightHeads::as_mapped;  // for drawing only
  bool fixed_lights = false;                       // as in evaluations (draw_light_plan()); else random durations
  LightCycles light_cycles = LightCycles::phases;
  DynamicsRules dynamics{};
  OtherShares others{};
  bool auxiliary_observations = true;  // false: zeros
  bool vector_observations = true;     // false: no entity sets, as in training from images
  bool wall_observations = false;      // no rows if `walls` is false
  std::array<ConditioningRange, kNumConditioning> conditioning = default_conditioning();

  static std::array<ConditioningRange, kNumConditioning> default_conditioning();
  /// Also enables all observations of another configuration.
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

/// Names of light cycles, in the order of LightCycles.
constexpr const char* kLightCyclesNames[] = {"phases", "independent"};
constexpr const char* name_of(LightCycles cycles) { return kLightCyclesNames[static_cast<int>(cycles)]; }
/// Throws UsageError, which lists the names, for a name not in kLightCyclesNames.
LightCycles light_cycles_named(std::string_view name);

/// Light cycles of a map: "none", "recorded", or the name of config.light_cycles.
std::string light_cycles_text(const SimulatorConfig& config, const CompiledMap& map);

/// World of a simulator.
struct WorldSpec {
  int map = 0;
  int num_agents = 0;
  uint32_t global_world = 0;  // unique across ranks; key of random numbers
  friend bool operator==(const WorldSpec&, const WorldSpec&) = default;
};

/// Draws sizes of worlds from U{min_agents, ..., max_agents} to fill num_slots; the last world is smaller to fit.
/// Worlds get the maps in turn. Throws UsageError unless 1 <= min_agents <= max_agents <= 4096 and num_slots >= 1.
std::vector<WorldSpec> draw_worlds(uint64_t seed, int num_slots, int min_agents, int max_agents, int num_maps);

/// Sizes for which a simulator has memory.
struct SimulatorCapacity {
  int64_t worlds = 0, slots = 0;
  int64_t lights = 0;     // in all worlds
  int64_t maps = 0;       // held at the same time
  int64_t map_bytes = 0;  // sum of MapRules::size_bytes()

  /// Controlled agents and parked cars.
  int64_t boxes(const SimulatorConfig& config) const { return slots + worlds * config.parked_cars; }
  bool holds(const SimulatorCapacity& other) const {
    return worlds >= other.worlds && slots >= other.slots && lights >= other.lights && maps >= other.maps &&
           map_bytes >= other.map_bytes;
  }
  /// Maximum of both capacities.
  SimulatorCapacity joined(const SimulatorCapacity& other) const;
};

using CompiledMaps = std::vector<std::shared_ptr<const CompiledMap>>;

/// Capacity that these worlds need.
SimulatorCapacity capacity_of(const CompiledMaps& maps, const std::vector<WorldSpec>& worlds);

/// Configuration, maps and worlds of a simulator.
struct SimulatorParts {
  SimulatorConfig config;
  CompiledMaps maps;
  std::vector<GeometryHandle> handles;  // [maps] by which scenes refer to the maps
  std::vector<WorldSpec> worlds;
};

/// Copy of a state in memory of Simulator::device(); see Simulator::snapshot().
class StateSnapshot {
 public:
  virtual ~StateSnapshot() = default;
};

/// Agents in the current episodes of all worlds.
struct SpawnReport {
  int64_t asked = 0, spawned = 0, refused = 0;      // asked == spawned + refused
  int64_t refused_no_place = 0, refused_taken = 0;  // `refused`, split by SpawnFailure
  int64_t entered = 0, left = 0;                    // open maps: later entries, and departures
  int64_t parked_asked = 0, parked_placed = 0;
};

/// Base class of simulators. Only one thread may use an object at a time; distinct objects are independent. Spans point
/// to memory of device().
///
/// Addresses of arrays stay valid until reserve() or set_worlds() must enlarge the arrays; generation() counts these
/// enlargements. set_worlds() changes lengths.
///
/// On a CUDA device, each call makes that device current and restores the caller's device. Calls put work on a stream
/// and share memory: issue them on one stream, or make each call wait for the previous one. step(), set_state(),
/// observe() and reset() with a mask neither wait nor allocate there, and a CUDA graph can capture them. If a value
/// (such as an action, slot or query) is invalid, poll(), check() or the next call throws the error.
class Simulator {
 public:
  virtual ~Simulator() = default;
  Simulator(const Simulator&) = delete;
  Simulator& operator=(const Simulator&) = delete;

  std::string_view name() const { return name_; }
  const SimulatorConfig& config() const { return parts_->config; }
  const CompiledMaps& maps() const { return parts_->maps; }
  /// [maps] Before drawing the scene, upload maps()[i]->geometry with handles()[i].
  const std::vector<GeometryHandle>& handles() const { return parts_->handles; }
  const std::vector<WorldSpec>& worlds() const { return parts_->worlds; }

  const SimulatorArrays& arrays() const { return arrays_; }
  Device device() const { return arrays_.device; }
  int num_slots() const { return static_cast<int>(arrays_.slots.world_of_slot.size()); }
  const SlotTable& slots() const { return arrays_.slots; }
  const ObservationView& observations() const { return arrays_.observations; }
  const SceneBatch& scene() const { return arrays_.scene; }
  /// One view per slot. The view of an absent agent is at the map's origin and has no ego; its images have no meaning.
  Span<const View> views() const { return arrays_.views; }
  const AgentStateView& state() const { return arrays_.state; }
  Span<const int32_t> episode_step() const { return arrays_.episode_step; }
  Span<const int32_t> episode_index() const { return arrays_.episode_index; }
  Span<const uint8_t> episode_over() const { return arrays_.episode_over; }
  /// Number of times that arrays moved in memory.
  uint64_t generation() const { return generation_; }

  /// Replaces the worlds and maps, and starts the first episodes of `seed`, bit for bit as a new simulator would.
  /// handles: [maps]; empty means 0, 1, and so on. On a device, allocates nothing if the capacity suffices, and copies
  /// only missing maps while there is memory for old and new maps. Captured graphs and controllers of the previous
  /// worlds become invalid. May wait for the stream. Throws as make_simulator() does, leaving everything unchanged.
  virtual void set_worlds(CompiledMaps maps, std::vector<GeometryHandle> handles, std::vector<WorldSpec> worlds,
                          uint64_t seed, Stream stream = {}) = 0;
  /// Allocates for later set_worlds() calls and preserves the state. May wait for the device.
  virtual void reserve(const SimulatorCapacity& capacity) = 0;

  /// Starts episode 0 of the configuration's seed in every world.
  void reset(Stream stream = {}) { reset_worlds({}, config().seed, stream); }
  /// Starts episode 0 of `seed` in the worlds with a nonzero mask, bit for bit as in a simulator of that seed. Other
  /// worlds and all totals stay unchanged. world_mask: u8 [worlds] on device(). Throws Error for another type, shape or
  /// device.
  void reset(const Array& world_mask, uint64_t seed, Stream stream = {});

  /// Sets fields of chosen agents. slots: i32 [n] on device(), all different. fields: arrays on device() with the names
  /// and types of fields.h, [n] or [n, per agent]. Recomputes lane, height (of the road on the level of z_m), box, view
  /// and observation. The halt_reason of an active agent becomes 0. An agent that found no place and now gets one
  /// counts as spawned. Results of the last step remain. Throws Error, leaving the state unchanged, for wrong names,
  /// types, shapes or devices, derived fields (is_derived()), and invalid slots or values.
  void set_state(const Array& slots, Span<const NamedArray> fields, Stream stream = {});

  /// Writes the observations that slots would have if some boxes were hidden and others inserted. Query i writes row i
  /// of `out`. Only the partners (observed road users) can differ from observations(). hidden: indices into
  /// scene().agents. out: one array [queries, rows, features] for each observed array; all others are empty. All spans
  /// must be in memory of device(). On a device, partners, lanes, boundaries and walls must begin at a multiple of 16
  /// bytes. Throws Error, without writing, for wrong lengths, more than 2^24 queries, or invalid queries. A query is
  /// invalid if its slot or a range is out of bounds, a hidden box is in another world, or an inserted number is not
  /// finite.
  void observe(Span<const ObservationQuery> queries, Span<const int32_t> hidden, Span<const InsertedBox> inserted,
               const ObservationView& out, Stream stream = {});

  /// Advances every world by one step. actions: i32 [slots] on device(), each in [0, kNumActions); actions of inactive
  /// agents are ignored. If the last step ended a world's episode, this step resets the world instead, and its slots
  /// are not valid (next-step autoreset). Throws Error, leaving the state unchanged, for another type, shape or device,
  /// and for an action out of range.
  StepResult step(const Array& actions, Stream stream = {});
  /// Advances by commands [slots]. If all are actions, the result is bit for bit that of the overload above.
  StepResult step(Span<const Command> commands, Stream stream = {});

  /// Throws Error if the host already knows of a rejected call; each rejection throws at most once. Does not wait.
  virtual void poll() {}
  /// Waits for the work on this stream, then calls poll().
  virtual void check(Stream /*stream*/ = {}) {}

  // On a device, the following functions wait for their stream and copy to the host.
  virtual SpawnReport spawn_report(Stream stream = {}) const = 0;
  virtual const SimulatorTotals& totals(Stream stream = {}) const = 0;
  /// Hash of the agents' fields, light states and parked cars; equal on all executors.
  virtual uint64_t state_hash(Stream stream = {}) const = 0;

  /// Save and restore the whole state, to resume exactly. restore() throws Error for bytes of another configuration.
  virtual std::vector<uint8_t> save(Stream stream = {}) const = 0;
  virtual void restore(Span<const uint8_t> bytes, Stream stream = {}) = 0;

  /// Copy and restore the state in memory of device(). On a device, restore() does not wait. It throws Error for a
  /// snapshot of other worlds or of another simulator.
  virtual std::unique_ptr<StateSnapshot> snapshot(Stream stream = {}) const = 0;
  virtual void restore(const StateSnapshot& snapshot, Stream stream = {}) = 0;

 protected:
  explicit Simulator(std::string_view name) : name_(name) {}

  // Executors set parts_ once, and arrays_ whenever worlds or addresses change.
  const SimulatorParts* parts_ = nullptr;
  SimulatorArrays arrays_;
  uint64_t generation_ = 0;

 private:
  // Types, shapes and devices are checked, but not values.
  virtual StepResult step_actions(Span<const int32_t> actions, Stream stream) = 0;
  virtual StepResult step_commands(Span<const Command> commands, Stream stream) = 0;
  // Arrays are checked. An empty mask means all worlds.
  virtual void reset_worlds(Span<const uint8_t> world_mask, uint64_t seed, Stream stream) = 0;
  virtual void apply_edit(const StateEdit& edit, Stream stream) = 0;
  virtual void answer_queries(const ObservationQueries& asked, Stream stream) = 0;

  std::string_view name_;
};

}  // namespace pictura
