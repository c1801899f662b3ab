// Index page of the replays in a folder.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// Throws the errors of write_gallery() before there is anything to list: Error naming a page (*.html) in the folder
/// that is not a replay, or an index.html that is not a gallery.
void check_gallery(const std::string& folder);

/// Writes FOLDER/index.html, which lists the replays (*.html) in the folder, worst first. Returns their number. Throws
/// Error as check_gallery() does.
int write_gallery(const std::string& folder);

}  // namespace pictura
