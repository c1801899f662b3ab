// Imports OpenDRIVE (.xodr) files as RoadMaps.
#pragma once

#include <functional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/plan_map.h"
#include "pictura/map/road_map.h"

namespace pictura {

struct OpenDriveOptions {
  float chord_error_m = 0.02f;  // maximum distance of a sampled curve from the true one
  bool strict = false;          // refuse every fault, also those that have one sensible meaning
  // What else than the identity imports a copy whose lanes keep their widths; it stretches and shrinks every length at
  // most by half, and does not mirror.
  PlanMap plan;
};

/// Told before each stage of an import: its name, and the share of the work that is done by then.
using ImportProgress = std::function<void(const char* stage, double done)>;

/// Parses the text of an OpenDRIVE file. `source` names it in messages. Faults that have one sensible meaning are
/// mended and noted in RoadMap::mends; throws Error naming source, line, owner and element for all others, and in
/// strict reading for any fault. docs/reference/opendrive_conformance.md lists them.
RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options = {},
                        const ImportProgress& progress = {});

}  // namespace pictura
