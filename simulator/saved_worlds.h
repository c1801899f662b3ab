// Worlds outside their simulator. Saved states of the worlds of one run are joined and split, so that another number of
// simulators can restore them. Single worlds can be kept and continued in other simulators.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Returns the worlds of part `part` of `num_parts`: consecutive worlds, at least one per part, with about equally many
/// agents in every part. Throws UsageError if there are fewer worlds than parts.
std::vector<WorldSpec> worlds_in_part(const std::vector<WorldSpec>& all, int part, int num_parts);

/// Joins the saved states of the parts' simulators, in order, into the saved state of a simulator of all these worlds.
/// `simulator` is one of the parts' simulators: it provides configuration and maps. Throws Error as Simulator::restore
/// does.
std::vector<uint8_t> join_saved_states(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                       const std::vector<std::vector<uint8_t>>& parts);

/// Extracts the saved state of `simulator`, which has part `part` of `num_parts`, from the saved state of a simulator
/// of all these worlds. Throws Error as Simulator::restore does.
std::vector<uint8_t> extract_saved_part(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                        Span<const uint8_t> saved, int part, int num_parts);

/// State of one world at one moment, on the host.
struct SavedWorld;

/// Extracts chosen worlds from a saved state of this simulator. Throws Error as Simulator::restore does.
std::vector<std::shared_ptr<const SavedWorld>> extract_worlds(const Simulator& simulator, Span<const uint8_t> saved,
                                                              const std::vector<size_t>& worlds);

/// Returns the saved state of this simulator with its worlds, in order, in these states: input of restore(). The worlds
/// may come from simulators with other observations or other walls. Throws Error if a world differs from the kept
/// one.
std::vector<uint8_t> saved_state_of(const Simulator& simulator, const std::vector<const SavedWorld*>& worlds);

}  // namespace pictura
