// What the ranks of a run must agree on before they go on: their settings, the files that they begin with, and when to
// end or save.
#pragma once

#include <string>

#include "pictura/configuration/config.h"
#include "pictura/training/ranks/communicator.h"

namespace pictura {

/// Throws Error on every rank, naming the key, where two ranks would not train the same. `manner`: what else must be
/// equal, as a text.
void check_equal_settings(const Config& config, const std::string& manner, Ranks* ranks);

/// Whether any rank says so.
bool any_rank(bool is_so, Communicator* communicator);

/// Whether ^C or the like came to any rank. From then on it has come to this one (common/support/interrupt.h).
bool any_rank_interrupted(Communicator* communicator);

/// The bytes of a checkpoint or of weights, which the first rank alone reads.
std::string file_of_first(const std::string& path, Communicator* communicator);

}  // namespace pictura
