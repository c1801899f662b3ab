// Importer of OpenDRIVE (.xodr) files.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/plan_map.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct OpenDriveOptions {
  float chord_error_m = 0.02f;  // maximum distance between a sampled curve and the exact curve
  bool strict = false;          // also refuse faults that could be repaired
  // Linear transformation of the ground plane, which makes an affine copy of the map. Lanes keep their widths. The
  // transformation must not mirror, and must not change any length by more than half.
  PlanMap plan;
};

/// Callback that an importer calls before each stage, with the stage's name and the share of the work that is done.
using ImportProgress = std::function<void(const char* stage, double done)>;

/// Parses the text of an OpenDRIVE file. `source` is the file's name in messages. Faults that have only one sensible
/// meaning are repaired and recorded in `RoadMap::mends`. Throws Error, which names source, line, owner and element,
/// for all other faults, and with options.strict for any fault. docs/reference/opendrive_conformance.md lists the
/// faults.
RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                        const ImportProgress& progress = {});

}  // namespace pictura
