#include "pictura/simulator/simulator_state.h"

#include <algorithm>
#include <array>
#include <cmath>
#include <cstring>
#include <numeric>

#include "pictura/common/error.h"
#include "pictura/simulator/agent_state_arrays.h"
#include "pictura/simulator/hash_values.h"
#include "pictura/simulator/rules/collision.h"
#include "pictura/simulator/rules/edit_state.h"
#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/rules/limits.h"
#include "pictura/simulator/rules/observe_query.h"

namespace pictura {
namespace {

struct SavedHeader {
  std::array<char, 8> magic{'P', 'I', 'C', 'S', 'T', 'A', 'T', 'E'};
  uint32_t version = 5;
  uint32_t byte_order = 0x01020304;
  uint64_t num_fingerprints = 0;  // number of fingerprints that follow the header
};

/// Hash of a property that must be equal in a saved state and in the simulator that restores it. Messages about a
/// mismatch contain the name.
struct Fingerprint {
  std::string name;
  uint64_t value = 0;
};

std::vector<Fingerprint> fingerprints(const SimulatorSetup& setup) {
  std::vector<Fingerprint> prints;
  const auto add = [&prints](std::string name, const auto&... values) {
    Hash64 hash;
    add_values(&hash, values...);
    prints.push_back({std::move(name), hash.value()});
  };
  // Newer options change a hash only if they differ from their default, so that states of earlier versions, which lack
  // these options, can be restored.
  const auto add_unusual = [&prints](bool is_unusual, const auto& value) {
    if (!is_unusual) return;
    Hash64 hash;
    add_values(&hash, prints.back().value, value);
    prints.back().value = hash.value();
  };
  const SimulatorConfig& config = setup.config;
  add("seed", config.seed);
  add("time (dt_s, episode_steps, reset_inactive_fraction, stagger_episodes)", config.dt_s, config.episode_steps,
      config.reset_inactive_fraction);
  add_unusual(config.stagger_episodes, config.stagger_episodes);
  add("population (pedestrian_fraction, cyclist_fraction, parked_cars, others)", config.pedestrian_fraction,
      config.cyclist_fraction, config.parked_cars);
  add_unusual(config.others != OtherShares{}, config.others);
  add("walls (walls, wall_seed)", config.walls, config.wall_seed);
  add("timing of the lights (fixed_lights, light_cycles)", config.fixed_lights);
  add_unusual(config.light_cycles != LightCycles::phases, config.light_cycles);
  Hash64 conditioning, worlds;
  for (const ConditioningRange& range : config.conditioning) {
    add_values(&conditioning, range.low, range.high, range.mixture);
  }
  prints.push_back({"conditioning or dynamics (reset_at_standstill)", conditioning.value()});
  // The second flag belongs to an option of earlier versions that no longer exists.
  add_unusual(config.dynamics.reset_at_standstill, std::array{true, false});
  for (const WorldSpec& world : setup.worlds) add_values(&worlds, world.map, world.num_agents, world.global_world);
  prints.push_back({"worlds", worlds.value()});
  add("number of maps", setup.maps.size());
  for (const auto& map : setup.maps) prints.push_back({fmt::format("map {}", map->road->name), map->fingerprint});
  if (config.after_infraction != AfterInfraction::halt || config.leave_at_goal) {
    add("way to end (after_infraction, leave_at_goal)", config.after_infraction, config.leave_at_goal);
  }
  return prints;
}

/// Throws Error, which names the field, unless every value can be simulated: indices must exist and numbers must be
/// finite.
void check_restored(const SimulatorSetup& setup, const SimulatorState& state, const AgentStateView& agents) {
  constexpr float kMaxCoordinate_m = kMaxCommanded_m;
  for (size_t w = 0; w < setup.worlds.size(); ++w) {
    const MapView& map = setup.map_views[setup.worlds[w].map];
    for (int slot = setup.slot_begin[w]; slot < setup.slot_begin[w + 1]; ++slot) {
      const AgentField field = invalid_field(map, setup.options, agents, slot);
      PICTURA_CHECK(field == AgentField::none, "simulator state: agent {}: {}: {} is out of range", slot,
                    kAgentFields[static_cast<size_t>(field)].name, field_text(agents, slot, field));
    }
    PICTURA_CHECK(state.spawned[w] >= 0 && state.spawned[w] <= setup.worlds[w].num_agents,
                  "simulator state: world {}: spawned: {} is out of range", w, state.spawned[w]);
    PICTURA_CHECK(state.episode_step[w] >= 0 && state.episode_step[w] <= setup.config.episode_steps,
                  "simulator state: world {}: episode_step: {} is out of range", w, state.episode_step[w]);
    PICTURA_CHECK(state.episode_index[w] >= 0, "simulator state: world {}: episode_index: {} is out of range", w,
                  state.episode_index[w]);
    for (const std::vector<AgentBox>* boxes : {&state.boxes, &state.boxes_before}) {
      for (auto i = static_cast<size_t>(setup.box_begin[w]); i < static_cast<size_t>(setup.box_begin[w + 1]); ++i) {
        const AgentBox& box = (*boxes)[i];
        const Vec3 at = box.center_m;
        // Comparisons are false for NaN.
        PICTURA_CHECK(std::fabs(at.x) <= kMaxCoordinate_m && std::fabs(at.y) <= kMaxCoordinate_m &&
                          std::fabs(at.z) <= kMaxCoordinate_m && std::fabs(box.cos_heading) <= 1.001f &&
                          std::fabs(box.sin_heading) <= 1.001f && box.length_m >= 0 && box.width_m >= 0 &&
                          box.height_m >= 0 && radius(box) <= map.max_box_radius_m &&
                          box.height_m <= kMaxCoordinate_m && static_cast<int>(box.agent_class) < kNumAgentClasses,
                      "simulator state: boxes: box {}: pose, size or class is out of range", i);
      }
    }
  }
  for (size_t i = 0; i < state.light_plans.size(); ++i) {
    const LightPlan& plan = state.light_plans[i];
    const int64_t slot_steps = int64_t{plan.green_steps} + plan.yellow_steps + plan.red_steps;
    PICTURA_CHECK(plan.green_steps >= 0 && plan.yellow_steps >= 0 && plan.red_steps >= 0 && slot_steps >= 1 &&
                      plan.num_phases >= 1 && plan.phase >= 0 && plan.offset_steps >= 0 &&
                      plan.offset_steps < slot_steps * plan.num_phases && slot_steps * plan.num_phases <= INT32_MAX / 2,
                  "simulator state: light_plans: light {}: the plan is out of range", i);
    PICTURA_CHECK(state.lights[i] <= LightState::unknown, "simulator state: lights: light {}: {} is out of range", i,
                  static_cast<int>(state.lights[i]));
  }
}

}  // namespace

void SimulatorState::resize(const SimulatorSetup& setup) {
  agents.resize(setup.num_slots());
  boxes.assign(setup.num_boxes(), {});
  boxes_before.assign(setup.num_boxes(), {});
  light_plans.assign(setup.num_lights(), {});
  lights.assign(setup.num_lights(), {});
  const size_t num_worlds = setup.worlds.size();
  seed.assign(num_worlds, setup.config.seed);
  episode_step.assign(num_worlds, 0);
  episode_index.assign(num_worlds, 0);
  episode_over.assign(num_worlds, 0);
  spawned.assign(num_worlds, 0);
  world_totals.assign(num_worlds, {});
}

void SimulatorState::reserve(const SimulatorCapacity& capacity, const SimulatorConfig& config) {
  const auto num_worlds = static_cast<size_t>(capacity.worlds), num_lights = static_cast<size_t>(capacity.lights);
  agents.reserve(capacity.slots);
  for (auto* its : {&boxes, &boxes_before}) its->reserve(capacity.boxes(config));
  light_plans.reserve(num_lights);
  lights.reserve(num_lights);
  for (auto* of_world : {&episode_step, &episode_index, &spawned}) of_world->reserve(num_worlds);
  seed.reserve(num_worlds);
  episode_over.reserve(num_worlds);
  world_totals.reserve(num_worlds);
}

SpawnReport SimulatorState::spawn_report(const SimulatorSetup& setup) const {
  SpawnReport report;
  report.asked = setup.num_slots();
  report.spawned = std::accumulate(spawned.begin(), spawned.end(), int64_t{0});
  const auto refused_for = [this](SpawnFailure reason) {
    return std::count(agents.refusal.begin(), agents.refusal.end(), reason);
  };
  report.refused_no_place = refused_for(SpawnFailure::no_place);
  report.refused_taken = refused_for(SpawnFailure::taken);
  report.refused = report.refused_no_place + report.refused_taken;
  report.entered = std::accumulate(agents.life.begin(), agents.life.end(), int64_t{0});
  report.left = report.entered + std::count(agents.status.begin(), agents.status.end(), AgentStatus::waiting);
  report.parked_asked = int64_t{setup.num_worlds()} * setup.config.parked_cars;
  for (size_t w = 0; w < setup.worlds.size(); ++w) {
    report.parked_placed +=
        std::count_if(boxes.begin() + setup.box_begin[w] + setup.worlds[w].num_agents,
                      boxes.begin() + setup.box_begin[w + 1], [](const AgentBox& box) { return box.drawn != 0; });
  }
  return report;
}

uint64_t SimulatorState::hash(const SimulatorSetup& setup) const {
  Hash64 hash;
  agents.add_to(&hash, setup.has_lives());
  hash.add(Span<const LightState>(lights));
  for (size_t w = 0; w < setup.worlds.size(); ++w) {
    const int first_parked = setup.box_begin[w] + setup.worlds[w].num_agents;
    hash.add(
        Span<const AgentBox>(boxes.data() + first_parked, static_cast<size_t>(setup.box_begin[w + 1] - first_parked)));
  }
  return hash.value();
}

SimulatorTotals SimulatorState::totals() const {
  SimulatorTotals sum;
  for (const SimulatorTotals& part : world_totals) sum.add(part);
  return sum;
}

void SimulatorState::copy_worlds(const SimulatorSetup& setup, int world, const SimulatorState& from,
                                 const SimulatorSetup& from_setup, int from_world, int count) {
  // begins[world] is the index of the world's first item; arrays have `per` elements for each item.
  const auto copy = [&](auto& to_array, const auto& from_array, const std::vector<int32_t>& begins,
                        const std::vector<int32_t>& from_begins, int per) {
    const auto first = from_array.begin() + int64_t{from_begins[from_world]} * per,
               last = from_array.begin() + int64_t{from_begins[from_world + count]} * per;
    std::copy(first, last, to_array.begin() + int64_t{begins[world]} * per);
  };
#define X(name, type, per_agent, first, comment) \
  copy(agents.name, from.agents.name, setup.slot_begin, from_setup.slot_begin, per_agent);
  PICTURA_AGENT_FIELDS(X)
#undef X
  visit_arrays_by_kind(
      *this, from, [&](auto& to, const auto& of) { copy(to, of, setup.box_begin, from_setup.box_begin, 1); },
      [&](auto& to, const auto& of) { copy(to, of, setup.light_begin, from_setup.light_begin, 1); },
      [&](auto& to, const auto& of) { std::copy_n(of.begin() + from_world, count, to.begin() + world); });
}

size_t SimulatorState::saved_bytes(bool with_lives) const {
  size_t sum = agents.size_bytes(with_lives);
  visit_arrays(*this, *this, [&sum](const auto& array, const auto&) { sum += array.size() * sizeof(*array.data()); });
  return sum;
}

void SimulatorState::assign_from(const uint8_t* bytes, bool with_lives) {
  agents.assign_from(bytes, with_lives);
  bytes += agents.size_bytes(with_lives);
  visit_arrays(*this, *this, [&bytes](auto& array, auto&) {
    const size_t size = array.size() * sizeof(*array.data());
    if (size > 0) std::memcpy(array.data(), bytes, size);
    bytes += size;
  });
}

void SimulatorState::copy_to(uint8_t* bytes_out, bool with_lives) const {
  agents.copy_to(bytes_out, with_lives);
  bytes_out += agents.size_bytes(with_lives);
  visit_arrays(*this, *this, [&bytes_out](const auto& array, const auto&) {
    const size_t size = array.size() * sizeof(*array.data());
    if (size > 0) std::memcpy(bytes_out, array.data(), size);
    bytes_out += size;
  });
}

std::vector<uint8_t> SimulatorState::save(const SimulatorSetup& setup) const {
  const std::vector<Fingerprint> prints = fingerprints(setup);
  SavedHeader header;
  header.num_fingerprints = prints.size();
  const size_t prints_bytes = prints.size() * sizeof(uint64_t);
  std::vector<uint8_t> bytes(sizeof(header) + prints_bytes + saved_bytes(setup.has_lives()));
  std::memcpy(bytes.data(), &header, sizeof(header));
  for (size_t i = 0; i < prints.size(); ++i) {
    std::memcpy(bytes.data() + sizeof(header) + i * sizeof(uint64_t), &prints[i].value, sizeof(uint64_t));
  }
  copy_to(bytes.data() + sizeof(header) + prints_bytes, setup.has_lives());
  return bytes;
}

void SimulatorState::restore(const SimulatorSetup& setup, Span<const uint8_t> bytes) {
  const SavedHeader expected;
  SavedHeader header;
  PICTURA_CHECK(bytes.size() >= sizeof(header), "simulator state: expected at least {} bytes, got {}", sizeof(header),
                bytes.size());
  std::memcpy(&header, bytes.data(), sizeof(header));
  PICTURA_CHECK(header.magic == expected.magic, "simulator state: not the bytes of a saved simulator");
  PICTURA_CHECK(header.byte_order == expected.byte_order,
                "simulator state: written on a machine with a different byte order");
  PICTURA_CHECK(header.version == expected.version, "simulator state: expected version {}, got {}", expected.version,
                header.version);
  const std::vector<Fingerprint> prints = fingerprints(setup);
  for (size_t i = 0; i < prints.size(); ++i) {
    const size_t at = sizeof(header) + i * sizeof(uint64_t);
    PICTURA_CHECK(bytes.size() >= at + sizeof(uint64_t),
                  "simulator state: ends within its fingerprints, after {} bytes", bytes.size());
    uint64_t saved = 0;
    std::memcpy(&saved, bytes.data() + at, sizeof(saved));
    PICTURA_CHECK(saved == prints[i].value, "simulator state: the saved state differs in: {}", prints[i].name);
  }
  PICTURA_CHECK(header.num_fingerprints == prints.size(), "simulator state: expected {} fingerprints, got {}",
                prints.size(), header.num_fingerprints);
  const size_t begin = sizeof(header) + prints.size() * sizeof(uint64_t);
  const bool with_lives = setup.has_lives();
  PICTURA_CHECK(bytes.size() == begin + saved_bytes(with_lives), "simulator state: expected {} bytes, got {}",
                begin + saved_bytes(with_lives), bytes.size());

  std::vector<uint8_t> present(saved_bytes(with_lives));
  copy_to(present.data(), with_lives);
  assign_from(bytes.data() + begin, with_lives);
  try {
    check_restored(setup, *this, agents.view());
  } catch (const Error&) {
    assign_from(present.data(), with_lives);
    throw;
  }
}

std::string rejection_text(int64_t rejected) {
  const int64_t slot = rejected >> 32 & 0x0FFFFFFF;
  switch (static_cast<CommandKind>(rejected >> 60)) {
    case CommandKind::action:
      return fmt::format("slot {}: expected an action in [0, {}), got {}", slot, kNumActions,
                         static_cast<int32_t>(rejected));
    case CommandKind::kinematic_state:
      return fmt::format("slot {}: expected a kinematic state within {} m, {} rad and {} m/s, got a state beyond", slot,
                         kMaxCommanded_m, kMaxCommanded_rad, kMaxCommanded_mps);
    case CommandKind::recorded:
      return fmt::format("slot {}: expected a world on a recorded scene, since its command follows the record", slot);
    default:
      return fmt::format("slot {}: expected a command that is an action, a kinematic state, absence or the record",
                         slot);
  }
}

std::string edit_fault_text(int64_t fault, int num_slots) {
  const auto what = static_cast<int32_t>(fault >> 56);
  const int64_t element = fault >> 32 & 0xFFFFFF;
  const auto slot = static_cast<int32_t>(fault);
  if (what == kNoSuchSlot) {
    return fmt::format("slots: element {}: expected a slot in [0, {}), got {}", element, num_slots, slot);
  }
  if (what == kSlotAgain) return fmt::format("slots: element {}: expected each slot once, got {} again", element, slot);
  const auto field = static_cast<AgentField>(what);
  const std::string_view name = kAgentFields[what].name;
  if (field == AgentField::goal_lane) {
    return fmt::format(
        "slot {}: goal_lane: expected a lane of the map, or for pedestrians a piece of a walkway, unless "
        "the agent is absent",
        slot);
  }
  return fmt::format("slot {}: {}: the value is out of range", slot, name);
}

std::string query_fault_text(int64_t fault, int num_slots) {
  const int64_t query = fault >> 32 & 0xFFFFFF;
  const auto value = static_cast<int32_t>(fault);
  const auto text = [query](std::string_view what) { return fmt::format("query {}: {}", query, what); };
  switch (static_cast<QueryFault>(fault >> 56)) {
    case QueryFault::slot: return text(fmt::format("expected a slot in [0, {}), got {}", num_slots, value));
    case QueryFault::hidden_begin:
      return text(fmt::format("hidden_begin: expected 0 to the length of the list of hidden boxes, got {}", value));
    case QueryFault::hidden_end:
      return text(
          fmt::format("hidden_end: expected hidden_begin to the length of the list of hidden boxes, got {}", value));
    case QueryFault::hidden_box:
      return text(fmt::format("hidden: expected boxes of the slot's own world, got box {} of the scene", value));
    case QueryFault::inserted_begin:
      return text(fmt::format("inserted_begin: expected 0 to the length of the list of inserted boxes, got {}", value));
    case QueryFault::inserted_end:
      return text(fmt::format(
          "inserted_end: expected inserted_begin to the length of the list of inserted boxes, got {}", value));
    default:
      return text(
          fmt::format("inserted: expected finite numbers, got non-finite numbers in box {} of the list", value));
  }
}

}  // namespace pictura
