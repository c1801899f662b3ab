// Reads the text of an OpenDRIVE file into a Network.
#pragma once

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Parses and checks `text`, which must outlive `network_out`. Throws Error naming source, line, owner and element for
/// anything malformed, missing, out of range or not supported that has no sensible meaning; the rest is mended. The
/// header's offset is applied.
void read_network(std::string_view text, const std::string& source_name, Faults* faults, Network* network_out);

}  // namespace pictura::opendrive
