// Saved states of worlds. The saved states of a run's simulators can be joined and split, so that a different number of
// simulators can restore them. Single worlds can be saved and continued in other simulators.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Splits the worlds into num_parts parts of consecutive worlds and returns part `part`. Each part has at least one
/// world, and all parts have about equally many agents. Throws UsageError if there are fewer worlds than parts.
std::vector<WorldSpec> worlds_in_part(const std::vector<WorldSpec>& all, int part, int num_parts);

/// Joins the saved states of several simulators, one per part of worlds_in_part(), into the saved state of a simulator
/// of all worlds. `simulator` is any of these simulators: it provides configuration and maps. Throws Error as
/// Simulator::restore does.
std::vector<uint8_t> join_saved_states(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                       const std::vector<std::vector<uint8_t>>& parts);

/// Inverse of join_saved_states(): extracts the saved state of `simulator`, which simulates part `part` of `num_parts`,
/// from the saved state of a simulator of all worlds. Throws Error as Simulator::restore does.
std::vector<uint8_t> extract_saved_part(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                        Span<const uint8_t> saved, int part, int num_parts);

/// State of one world at one moment, on the host.
struct SavedWorld;

/// Extracts chosen worlds from a saved state of this simulator. Throws Error as Simulator::restore does.
std::vector<std::shared_ptr<const SavedWorld>> extract_worlds(const Simulator& simulator, Span<const uint8_t> saved,
                                                              const std::vector<size_t>& worlds);

/// Returns a state for simulator.restore() in which world i has the state worlds[i]. The saved worlds may come from
/// simulators with other observations or other walls. Throws Error if a saved world differs from the simulator's world
/// in map, number of agents, id, or number of boxes or lights.
std::vector<uint8_t> saved_state_of(const Simulator& simulator, const std::vector<const SavedWorld*>& worlds);

}  // namespace pictura
