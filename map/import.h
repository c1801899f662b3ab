// Functions that all importers of map files share: a check of options, a limit on samples, and errors that name the
// file.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "pictura/common/support/interrupt.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/polyline.h"

namespace pictura {

/// Throws Error if options.chord_error_m is outside [0.001, 10] m, or if options.plan mirrors or has a singular value
/// outside [0.5, 1.5].
void check_import_options(const OpenDriveOptions& options);

/// Returns the limit on samples of curves for a file of `text_bytes` bytes. It bounds the import time of small files
/// and the memory for large files. `source` is the file's name in messages.
SampleBudget import_budget(std::size_t text_bytes, const std::string& source, const InterruptibleWork& work);

/// Returns the RoadMap that import() returns. Adds the file's name, `source`, to the messages of errors that do not
/// begin with it.
template <typename Import>
RoadMap import_named(const std::string& source, Import&& import) {
  try {
    return std::forward<Import>(import)();
  } catch (const Interrupted&) {
    throw;
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.starts_with(source)) throw;
    fail("{}: {}", source, message);
  }
}

}  // namespace pictura
