// What all importers of map files share: checked options, a budget, progress, and errors that name the file.
#pragma once

#include <cstddef>
#include <functional>
#include <string>

#include "pictura/common/support/interrupt.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/polyline.h"

namespace pictura {

/// One import: what the importer may ask for, and the map that it fills.
class MapImport {
 public:
  MapImport(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& import_options,
            const ImportProgress& progress);

  /// Reports the stage that begins, and the share of the work that is done. Throws Interrupted after a signal.
  void begin(const char* stage, double done) const;
  /// Bounds the import time of small files and the memory of large ones.
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

/// Calls fill(import) and returns the validated map with its repairs. `source` is the file's name in messages, and is
/// added to errors that do not name it, because they are about the file as a whole. Throws Error unless
/// options.chord_error_m is in [0.001, 10] m, the singular values of options.plan are in [0.5, 1.5], and the plan does
/// not mirror.
RoadMap import_map(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& options,
                   const ImportProgress& progress, const std::function<void(MapImport* import)>& fill);

}  // namespace pictura
