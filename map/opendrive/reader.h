// Reads the text of an OpenDRIVE file into a Network.
#pragma once

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Parses and checks `text`, and applies the header's offset. `text` must outlive `network_out`. Repairs faults that
/// have only one sensible meaning. Throws Error, which names source, line, owner and element, for other faults (in
/// strict reading, for all).
void read_network(std::string_view text, const std::string& source_name, Faults* faults, Network* network_out);

}  // namespace pictura::opendrive
