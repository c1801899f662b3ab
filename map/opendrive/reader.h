// From the text of an OpenDRIVE file to its Network.
#pragma once

#include "pictura/map/opendrive/faults.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Parses and checks `text`, which must outlive `network_out`. Throws Error naming source, line, road and element for
/// whatever is malformed, missing, out of range or not supported, unless `faults` lets it pass: then the mark, object,
/// signal, reference, link, connection, lane or road around it is left out. The header's offset is applied.
void read_network(std::string_view text, const std::string& source_name, Faults* faults, Network* network_out);

}  // namespace pictura::opendrive
