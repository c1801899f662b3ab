#include "pictura/map/map_fields.h"

#include "pictura/map/field_difference.h"

namespace pictura {

std::string first_difference(const RoadMap& a, const RoadMap& b) { return difference_of(a, b); }

}  // namespace pictura
