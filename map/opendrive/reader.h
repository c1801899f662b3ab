// Reads an OpenDRIVE file into a Network.
#pragma once

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Parses and checks `text`, which must outlive `network_out`, and applies the header's offset. Repairs and throws as
/// parse_opendrive() does.
void read_network(std::string_view text, const std::string& source_name, Faults* faults, Network* network_out);

}  // namespace pictura::opendrive
