// Agreement of a run's ranks.
#pragma once

#include <string>

#include "pictura/configuration/config.h"
#include "pictura/training/ranks/communicator.h"

namespace pictura {

/// Throws Error on every rank, naming the key, if two ranks' settings differ. manner: other settings that must be
/// equal, as text.
void check_equal_settings(const Config& config, const std::string& manner, Ranks* ranks);

/// Whether `is_so` is true on any rank.
bool any_rank(bool is_so, Communicator* communicator);

/// Whether any rank was interrupted. This rank then counts as interrupted too.
bool any_rank_interrupted(Communicator* communicator);

/// Returns the bytes of a file, which only rank 0 reads.
std::string file_of_first(const std::string& path, Communicator* communicator);

}  // namespace pictura
