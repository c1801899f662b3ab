// Agreement of a run's ranks on settings, initial files, and interrupts.
#pragma once

#include <string>

#include "pictura/configuration/config.h"
#include "pictura/training/ranks/communicator.h"

namespace pictura {

/// Throws Error on every rank, naming the key, if two ranks' settings differ. `manner`: further settings that must be
/// equal, as text.
void check_equal_settings(const Config& config, const std::string& manner, Ranks* ranks);

/// Returns whether `is_so` is true on any rank.
bool any_rank(bool is_so, Communicator* communicator);

/// Returns whether any rank was interrupted. If so, this rank counts as interrupted too (common/support/interrupt.h).
bool any_rank_interrupted(Communicator* communicator);

/// Returns the bytes of a checkpoint file or weights file. Only rank 0 reads the file.
std::string file_of_first(const std::string& path, Communicator* communicator);

}  // namespace pictura
