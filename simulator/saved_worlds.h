// Saved states of worlds, which other simulators can restore.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Splits the worlds into num_parts consecutive ranges with about equally many agents, and at least one world each.
/// Returns range `part`. Throws UsageError if there are fewer worlds than parts.
std::vector<WorldSpec> worlds_in_part(const std::vector<WorldSpec>& all, int part, int num_parts);

/// Joins the states saved by the simulators of all parts, of which `simulator` is one. Throws Error as
/// Simulator::restore does.
std::vector<uint8_t> join_saved_states(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                       const std::vector<std::vector<uint8_t>>& parts);

/// Extracts the saved state of part `part`, which `simulator` simulates. Throws Error as Simulator::restore does.
std::vector<uint8_t> extract_saved_part(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                        Span<const uint8_t> saved, int part, int num_parts);

/// State of one world, on the host.
struct SavedWorld;

/// Throws Error as Simulator::restore does.
std::vector<std::shared_ptr<const SavedWorld>> extract_worlds(const Simulator& simulator, Span<const uint8_t> saved,
                                                              const std::vector<size_t>& worlds);

/// Returns a state for simulator.restore() in which world i has the state worlds[i]. worlds[i] may come from a
/// simulator with other observations or walls. Throws Error if a world differs in map, id, or number of agents, boxes
/// or lights.
std::vector<uint8_t> saved_state_of(const Simulator& simulator, const std::vector<const SavedWorld*>& worlds);

}  // namespace pictura
