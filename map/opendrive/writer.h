// From a Network back to the text of an OpenDRIVE file.
#pragma once

#include <string>
#include <string_view>

#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// The network as OpenDRIVE text. Every number is written with as many digits as it takes to read the same double
/// again, so that reading and writing what was written once changes nothing. What a Network does not hold (names,
/// weights and materials of marks, objects other than crosswalks and parking spaces) is not written.
std::string write_opendrive(const Network& network);

}  // namespace pictura::opendrive

namespace pictura {

/// Reads the text of an OpenDRIVE file and writes it again, with no more in it than the importer uses. Throws Error
/// naming `source`, line and element for whatever the importer refuses.
std::string export_opendrive(std::string_view text, const std::string& source);

}  // namespace pictura
