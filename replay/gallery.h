// Index page of a folder's replays.
#pragma once

#include <string>

#include "pictura/common/error_types.h"

namespace pictura {

/// Throws Error naming a page (*.html) that is not a replay, or an index.html that is not a gallery. Ignores the pages
/// of an earlier gallery, which FilledFolder replaces.
void check_gallery(const std::string& folder);

/// Writes FOLDER/index.html, the worst replay first. Returns the number of replays. Throws Error as check_gallery()
/// does, for all pages.
int write_gallery(const std::string& folder);

}  // namespace pictura
