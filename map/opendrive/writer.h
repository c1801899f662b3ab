// Writes a Network as the text of an OpenDRIVE file.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// The network as OpenDRIVE text. Numbers have as many digits as needed to read back the same double, so that reading
/// and writing the output again changes nothing. What a Network does not contain (names, weights and materials of
/// marks, objects other than crosswalks, parking spaces and stop lines) is not written.
std::string write_opendrive(const Network& network);

}  // namespace pictura::opendrive

namespace pictura {

/// Reads the text of an OpenDRIVE file and writes only what the importer uses. Throws Error naming `source`, line and
/// element for whatever the importer rejects.
std::string export_opendrive(std::string_view text, const std::string& source);

}  // namespace pictura
