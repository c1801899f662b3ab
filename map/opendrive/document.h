// Parses the XML of an OpenDRIVE file.
#pragma once

#include <string_view>

#include <pugixml.hpp>

#include "pictura/common/error_types.h"
#include "pictura/map/opendrive/model.h"

namespace pictura::opendrive {

/// Throws Error, which names source and line, if `text` is not well-formed UTF-8 XML. Also throws Error for a document
/// type, an <include>, more than 64 nested elements, and an attribute of more than 4 KiB.
void read_document(std::string_view text, const Source& source, pugi::xml_document* document_out);

}  // namespace pictura::opendrive
