// Writes a Network as the text of an OpenDRIVE file.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Returns a network as OpenDRIVE text. Numbers have enough digits to be read back as the same double. So the text does
/// not change if it is read and written again. Data that a Network lacks is not written: names of roads, junctions and
/// controllers, materials of marks, and all objects except crosswalks, parking spaces and stop lines.
std::string write_opendrive(const Network& network);

}  // namespace pictura::opendrive

namespace pictura {

/// Reads the text of an OpenDRIVE file and returns OpenDRIVE text with only the data that the importer uses. Throws
/// Error, which names `source`, line and element, if the importer rejects the file.
std::string export_opendrive(std::string_view text, const std::string& source);

}  // namespace pictura
