// Agreement of a run's ranks on their settings, on the files that they begin with, and on when to end.
#pragma once

#include <string>

#include "pictura/configuration/config.h"
#include "pictura/training/ranks/communicator.h"

namespace pictura {

/// Throws Error on every rank, naming the key, where two ranks' settings differ. `manner`: what else must be equal, as
/// a text.
void check_equal_settings(const Config& config, const std::string& manner, Ranks* ranks);

/// Whether `is_so` holds on any rank.
bool any_rank(bool is_so, Communicator* communicator);

/// Whether ^C or the like came to any rank. If so, this rank counts as interrupted too (common/support/interrupt.h).
bool any_rank_interrupted(Communicator* communicator);

/// Bytes of a checkpoint or of weights, which the first rank alone reads.
std::string file_of_first(const std::string& path, Communicator* communicator);

}  // namespace pictura
