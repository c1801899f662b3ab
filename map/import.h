// What all importers of map files share: checked options, a budget, and errors that name the file.
#pragma once

#include <cstddef>
#include <string>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/polyline.h"

namespace pictura {

/// Throws Error unless the chord error is in [0.001, 10] m, the singular values of the plan are in [0.5, 1.5] and it
/// does not mirror.
void check_import_options(const OpenDriveOptions& options);

/// Bounds the import time of small files and the memory of large ones.
SampleBudget import_budget(std::size_t text_bytes, const std::string& source, const InterruptibleWork& work);

/// Calls import() -> RoadMap. Adds the file's name to errors that do not name it, because they are about the file as a
/// whole.
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
