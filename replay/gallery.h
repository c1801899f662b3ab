// Index page of the replays in a folder.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// Checks a folder before replays are written to it. Throws Error, which names the file, if a page (*.html) in the
/// folder is not a replay, or if its index.html is not a gallery.
void check_gallery(const std::string& folder);

/// Writes FOLDER/index.html, which lists the replays (*.html) in the folder, the worst first. Returns the number of
/// replays. Throws Error as check_gallery() does.
int write_gallery(const std::string& folder);

}  // namespace pictura
