// Steps that all importers of map files share.
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

/// State of one import.
class MapImport {
 public:
  MapImport(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& import_options,
            const ImportProgress& progress);

  /// Reports the stage and the completed share of the work. Throws Interrupted after a signal.
  void begin(const char* stage, double done) const;
  /// Returns a limit that grows with the size of the file.
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

/// Calls fill(import), records the repairs in the map, and returns the validated map. Messages of faults begin
/// with `source`, the file's name. Throws Error if options.chord_error_m is outside [0.001, 10] m. Also throws if the
/// transformation options.plan mirrors the map or has a singular value outside [0.5, 1.5].
RoadMap import_map(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& options,
                   const ImportProgress& progress, const std::function<void(MapImport* import)>& fill);

}  // namespace pictura
