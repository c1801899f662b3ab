// Steps that all importers of map files share: a check of options, progress, a limit on samples, repairs, and errors
// that name the file.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "pictura/common/error_types.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/polyline.h"

namespace pictura {

/// State of one import: the map, and what the importer needs to fill it.
class MapImport {
 public:
  MapImport(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& import_options,
            const ImportProgress& progress);

  /// Reports the stage that begins, and the completed share of the work. Throws Interrupted after a signal.
  void begin(const char* stage, double done) const;
  /// Returns the limit on samples of curves. It bounds the import time of small files and the memory for large files.
  SampleBudget budget() const;

  const OpenDriveOptions& options;
  opendrive::Faults faults;
  RoadMap map;

 private:
  std::size_t text_bytes_;
  const std::string& source_;
  const ImportProgress& progress_;
  InterruptibleWork work_;
};

/// Calls fill(import), and returns the validated map with its repairs. Adds the file's name, `source`, to error
/// messages that do not begin with it. Throws Error if options.chord_error_m is outside [0.001, 10] m, or if the linear
/// map options.plan contains a reflection or has a singular value outside [0.5, 1.5].
RoadMap import_map(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& options,
                   const ImportProgress& progress, const std::function<void(MapImport* import)>& fill);

}  // namespace pictura
