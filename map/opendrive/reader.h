// From the text of an OpenDRIVE file to its Network.
#pragma once

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Parses and checks `text`, which must outlive `network_out`. Throws Error naming source, line, road and element for
/// whatever is malformed, missing, out of range or not supported.
void read_network(std::string_view text, const std::string& source_name, Network* network_out);

}  // namespace pictura::opendrive
