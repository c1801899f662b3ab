// Writer from a Network to the text of an OpenDRIVE file.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Writes a network as OpenDRIVE text. Numbers have enough digits to read back the same double, so that reading the
/// output and writing it again changes nothing. Data that a Network lacks (names, weights and materials of marks,
/// objects other than crosswalks, parking spaces and stop lines) is not written.
std::string write_opendrive(const Network& network);

}  // namespace pictura::opendrive

namespace pictura {

/// Reads the text of an OpenDRIVE file and returns OpenDRIVE text with only the data that the importer uses. Throws
/// Error naming `source`, line and element if the importer rejects the file.
std::string export_opendrive(std::string_view text, const std::string& source);

}  // namespace pictura
