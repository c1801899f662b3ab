// Memory that the phases of the CUDA executor read and write (phases.h).
#pragma once

#include "pictura/simulator/observation.h"
#include "pictura/simulator/rules/box_chains.h"
#include "pictura/simulator/rules/episode.h"

namespace pictura::cuda {

/// Number of threads that share an agent: about the number of lane segments, barriers and boxes to test.
constexpr int kThreadsPerAgent = 8, kWarp = 32;

/// A world's memory for spawning. A try is a candidate place of a box.
struct WorldScratch {
  AgentBox* try_boxes = nullptr;   // [boxes, kSpawnTries] boxes of the free tries
  uint32_t* free_tries = nullptr;  // [boxes] bit t is 1 if try t is known to be permitted and to touch no placed box
  int32_t* known_tries = nullptr;  // [boxes] number of evaluated tries
  int32_t* chosen_try = nullptr;   // [boxes] chosen try; -1: none
  int32_t* next_try = nullptr;     // [boxes] choice in the current round; -1: none
  BoxChains standing;              // boxes that have a place
  // Arrays of a crowd's box_cells, for writing (see is_crowd()); null if the world is no crowd.
  int32_t *cell_begin = nullptr, *cell_items = nullptr;
};

/// Value that marks that there is no such slot or element. All its bytes are equal, so that memset can write it.
constexpr int32_t kNoSlot = 0x7F7F7F7F;

/// Addresses of all memory that the phases read and write, in one memory space.
struct PhaseArrays {
  WorldView* worlds = nullptr;             // [num_worlds] box_cells: see one_cell() and is_crowd()
  WorldView* next_worlds = nullptr;        // [num_worlds] the same worlds, with the memory of their next episode
  const WorldScratch* scratch = nullptr;   // [num_worlds]
  const int32_t* world_of_slot = nullptr;  // [num_slots]
  int32_t num_worlds = 0, num_slots = 0;
  // Agents of all worlds. The views also contain these pointers, but a kernel would read the pointers from a view again
  // after each store.
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
  uint8_t has_lives = 0;            // whether some map has roads that end
  uint8_t has_replayed_tracks = 0;  // whether some map has replayed tracks
  int32_t parked_per_world = 0;     // number of boxes of a world that belong to no agent
  uint8_t has_crowds = 0;           // whether some world is a crowd
  // Values that phases and steps pass to later ones:
  uint8_t* began =
      nullptr;  // [num_worlds] whether an episode began in the last step, so the next episode must be prepared
  uint8_t* prepares = nullptr;          // [num_worlds] whether the next episode is prepared in the current step
  int32_t* next_spawned = nullptr;      // [num_worlds] number of agents in the next episode
  int32_t* rejected_slot = nullptr;     // lowest slot with a command out of range, or kNoSlot
  int64_t* rejected_command = nullptr;  // first rejected command since the host checked, or kNoRejection
  int32_t* first_element = nullptr;     // [num_slots] first element of an edit for the slot, or kNoSlot
  int32_t* faulty_element = nullptr;    // first faulty element of the edit or the queries, or kNoSlot
  int64_t* faulty_edit = nullptr;       // first fault of an edit since the host checked, or kNoEditFault
  int64_t* faulty_query = nullptr;      // first fault of a query since the host checked, or kNoQueryFault

  PICTURA_HD WorldView world(int w) const {
    WorldView world = worlds[w];
    world.agents = agents;
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

/// Returns whether a world has so many boxes that they are sorted into cells.
PICTURA_HD constexpr bool is_crowd(int num_boxes) { return num_boxes > 512; }

/// Returns a grid of one cell with all boxes of a world that is no crowd. In such a world, a warp tests all boxes
/// faster than it could sort them.
PICTURA_HD inline GridView one_cell(Span<const int32_t> begin, Span<const int32_t> items) {
  constexpr float kWhole_m = 1e9f;
  return {{}, kWhole_m, 1, 1, begin, items};
}

/// Returns the grid of a crowd's boxes, with at most as many cells as boxes.
PICTURA_HD inline GridView crowd_cells(GridView cells, const int32_t* begin, Span<const int32_t> items) {
  cells.begin = {begin, static_cast<size_t>(cells.num_x * cells.num_y) + 1};
  cells.items = items;
  return cells;
}

/// Returns the centre of a box. The centre of a box that is not drawn is far from all other boxes.
PICTURA_HD inline Vec2 center_of(const AgentBox& box) {
  constexpr float kNowhere_m = 1e9f;
  return box.drawn ? box.center_m.xy() : Vec2{kNowhere_m, kNowhere_m};
}

}  // namespace pictura::cuda
