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
  bool strict = false;          // refuse every fault, including faults with one sensible meaning
  // Plan of a copy whose lanes keep their widths. It must not mirror, nor change any length by more than half.
  PlanMap plan;
};

/// Callback before each stage of an import, with the stage's name and the share of the work that is done.
using ImportProgress = std::function<void(const char* stage, double done)>;

/// Parses the text of an OpenDRIVE file. `source` is its name in messages. Faults that have one sensible meaning are
/// repaired and recorded in `RoadMap::mends`. Throws Error naming source, line, owner and element for all other faults,
/// and in strict reading for any fault. docs/reference/opendrive_conformance.md lists the faults.
RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                        const ImportProgress& progress = {});

}  // namespace pictura
