// An index page over the replays of a folder.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// Throws Error naming a page (*.html) in the folder that is no replay, or an index.html that is none of a gallery:
/// what write_gallery() would throw, before there is anything to list.
void check_gallery(const std::string& folder);

/// Writes FOLDER/index.html, which lists the replays (*.html) that lie in the folder, worst first. Returns how many.
/// Throws Error as check_gallery() does.
int write_gallery(const std::string& folder);

}  // namespace pictura
