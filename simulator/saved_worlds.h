// Worlds that leave their simulator: those of one run divided among several, whose saved states are joined and parted,
// so that what some number of simulators saved another number can restore; and single worlds, kept to go on in others.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// The worlds of part `part` of `num_parts`: consecutive ones, at least one each, with about as many agents as those of
/// every other part. Throws UsageError where there are fewer worlds than parts.
std::vector<WorldSpec> worlds_of_part(const std::vector<WorldSpec>& all, int part, int num_parts);

/// What a simulator of all these worlds would have saved, from what simulators of their parts, in order, did. The
/// simulator is one of them: it lends configuration and maps. Throws Error as Simulator::restore does.
std::vector<uint8_t> join_saved_states(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                       const std::vector<std::vector<uint8_t>>& parts);

/// What the simulator would have saved, from what one of all these worlds, of which it has part `part` of `num_parts`,
/// did. Throws Error as Simulator::restore does.
std::vector<uint8_t> part_of_saved_state(const Simulator& simulator, const std::vector<WorldSpec>& all,
                                         Span<const uint8_t> saved, int part, int num_parts);

/// A world at one moment, by itself and on the host.
struct KeptWorld;

/// Chosen worlds of what save() gave of this simulator. Throws Error as Simulator::restore does.
std::vector<std::shared_ptr<const KeptWorld>> keep_worlds(const Simulator& simulator, Span<const uint8_t> saved,
                                                          const std::vector<size_t>& worlds);

/// What this simulator's worlds, in order, would have saved at these moments: what restore() takes. They may come from
/// simulators with other observations, and with other walls. Throws Error where a world is not the one that was kept.
std::vector<uint8_t> saved_state_of(const Simulator& simulator, const std::vector<const KeptWorld*>& worlds);

}  // namespace pictura
