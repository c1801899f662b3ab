// Parsing of an OpenDRIVE file's XML, with rejection of unsafe documents.
#pragma once

#include <string_view>

#include <pugixml.hpp>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Parses `text`. Throws Error naming source and line unless the text is well-formed UTF-8 XML without a document type,
/// nested at most 64 deep, with attributes of at most 64 KiB.
void read_document(std::string_view text, const Source& source, pugi::xml_document* document_out);

}  // namespace pictura::opendrive
