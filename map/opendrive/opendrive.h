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
  // Plan of an affine copy, whose lanes keep their widths. It must not mirror, or change any length by more than half.
  PlanMap plan;
};

/// Called before each stage of an import, with the stage's name and the share of the work that is done.
using ImportProgress = std::function<void(const char* stage, double done)>;

/// Parses an OpenDRIVE file; `source` is its name in messages. Faults with only one sensible meaning are repaired and
/// recorded in `RoadMap::mends`. Throws Error, which names source, line, owner and element, for other faults, and with
/// options.strict for all faults. docs/reference/opendrive_conformance.md lists the faults.
RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                        const ImportProgress& progress = {});

}  // namespace pictura
