// An index page over the replays of a folder.
#pragma once

#include <string>

#include "pictura/common/error.h"

namespace pictura {

/// Writes FOLDER/index.html, which lists the replays (*.html) that lie in the folder, worst first. Returns how many.
/// Throws Error naming a page that is no replay.
int write_gallery(const std::string& folder);

}  // namespace pictura
