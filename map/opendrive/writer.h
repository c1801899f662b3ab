// Writes a Network as an OpenDRIVE file.
#pragma once

#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Returns a network as OpenDRIVE text. Reading the text gives the same doubles, and writing it again gives the same
/// text. Data that a Network lacks is not written, such as materials of marks, names of roads, and other kinds of
/// objects.
std::string write_opendrive(const Network& network);

}  // namespace pictura::opendrive

namespace pictura {

/// Returns OpenDRIVE text with only the data that the importer uses. Throws Error, which names `source`, line and
/// element, if the importer rejects `text`.
std::string export_opendrive(std::string_view text, const std::string& source);

}  // namespace pictura
