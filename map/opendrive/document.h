// Parses the XML of an OpenDRIVE file, and rejects unsafe documents.
#pragma once

#include <string_view>

#include <pugixml.hpp>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Parses `text`. Throws Error, which names source and line, if the text is not well-formed UTF-8 XML. Also throws
/// Error for a document type, an <include>, nesting of more than 64 elements, and an attribute of more than 4 KiB.
void read_document(std::string_view text, const Source& source, pugi::xml_document* document_out);

}  // namespace pictura::opendrive
