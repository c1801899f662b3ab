// Memory that the phases of the CUDA executor read and write (phases.h).
#pragma once

#include "pictura/simulator/observation.h"
#include "pictura/simulator/rules/box_chains.h"
#include "pictura/simulator/rules/episode.h"

namespace pictura::cuda {

/// Threads that share an agent, about as many as it has segments, barriers and boxes to test.
constexpr int kThreadsPerAgent = 8, kWarp = 32;

/// A world's memory for spawning. A try is a candidate place of a box.
struct WorldScratch {
  AgentBox* try_boxes = nullptr;   // [boxes, kSpawnTries] boxes of the free tries
  uint32_t* free_tries = nullptr;  // [boxes] bit t: try t is known to be permitted and to touch no placed box
  int32_t* known_tries = nullptr;  // [boxes] evaluated tries
  int32_t* chosen_try = nullptr;   // [boxes] chosen try; -1: none
  int32_t* next_try = nullptr;     // [boxes] choice in the current round; -1: none
  BoxChains standing;              // boxes that have a place
  // Writable box_cells of a crowd; null for other worlds.
  int32_t *cell_begin = nullptr, *cell_items = nullptr;
};

/// Value for no slot or element. All its bytes are equal, so that memset can write it.
constexpr int32_t kNoSlot = 0x7F7F7F7F;

/// Addresses of the phases' memory, in one memory space.
struct PhaseArrays {
  WorldView* worlds = nullptr;             // [num_worlds]
  WorldView* next_worlds = nullptr;        // [num_worlds] these worlds, with the memory of their next episode
  const WorldScratch* scratch = nullptr;   // [num_worlds]
  const int32_t* world_of_slot = nullptr;  // [num_slots]
  int32_t num_worlds = 0, num_slots = 0;
  // Agents of all worlds. Views contain these pointers too, but kernels would reread them after each store.
  AgentStateView agents{}, next_agents{};
  // State, with the names of SimulatorState:
  uint64_t* seed = nullptr;
  int32_t* episode_step = nullptr;
  int32_t* episode_index = nullptr;
  uint8_t* episode_over = nullptr;
  int32_t* spawned = nullptr;
  SimulatorTotals* world_totals = nullptr;
  // Results:
  StepArrays results;
  View* views = nullptr;
  uint8_t* driver = nullptr;
  ObservationView observations;
  uint8_t entity_sets = 0;
  uint8_t has_lives = 0;  // whether some map has roads that end
  uint8_t has_replayed_tracks = 0;
  uint8_t has_other_drivers = 0;
  int32_t parked_per_world = 0;  // boxes of a world that belong to no agent
  uint8_t has_crowds = 0;
  // Values for later phases and steps:
  uint8_t* began = nullptr;             // [num_worlds] an episode began in the last step
  uint8_t* prepares = nullptr;          // [num_worlds] the next episode is prepared in this step
  int32_t* next_spawned = nullptr;      // [num_worlds] agents in the next episode
  int32_t* rejected_slot = nullptr;     // lowest slot with a command out of range, or kNoSlot
  int64_t* rejected_command = nullptr;  // first rejection since the host checked, or kNoRejection
  int32_t* first_element = nullptr;     // [num_slots] first element of an edit, or kNoSlot
  int32_t* faulty_element = nullptr;    // first faulty element of a request, or kNoSlot
  int64_t* faulty_edit = nullptr;       // first fault since the host checked, or kNoEditFault
  int64_t* faulty_query = nullptr;      // first fault since the host checked, or kNoQueryFault

  PICTURA_HD WorldView world(int w) const {
    WorldView world = worlds[w];
    world.agents = agents;
    world.has_other_drivers = has_other_drivers;
    world.step = episode_step[w];
    return world;
  }
  PICTURA_HD WorldView next_world(int w) const {
    WorldView world = next_worlds[w];
    world.agents = next_agents;
    return world;
  }
  PICTURA_HD bool has_rejected_command() const { return *rejected_slot != kNoSlot; }
};

/// Whether a world's boxes are sorted into cells.
PICTURA_HD constexpr bool is_crowd(int num_boxes) { return num_boxes > 512; }

/// Returns a grid of one cell, for a world that is no crowd. A warp tests such a world's boxes faster than it sorts
/// them.
PICTURA_HD inline GridView one_cell(Span<const int32_t> begin, Span<const int32_t> items) {
  constexpr float kWhole_m = 1e9f;
  return {{}, kWhole_m, 1, 1, begin, items};
}

/// cells: a grid of at most as many cells as boxes.
PICTURA_HD inline GridView crowd_cells(GridView cells, const int32_t* begin, Span<const int32_t> items) {
  cells.begin = {begin, static_cast<size_t>(cells.num_x * cells.num_y) + 1};
  cells.items = items;
  return cells;
}

/// The centre of a box that is not drawn is far from all other boxes.
PICTURA_HD inline Vec2 center_of(const AgentBox& box) {
  constexpr float kNowhere_m = 1e9f;
  return box.drawn ? box.center_m.xy() : Vec2{kNowhere_m, kNowhere_m};
}

}  // namespace pictura::cuda
