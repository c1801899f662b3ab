// Projections of latitude and longitude to metres, as maps of Lanelet2 need them: UTM, and squares of MGRS.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"

namespace pictura {

/// A place on the WGS 84 ellipsoid, in degrees.
struct GeoPoint {
  double latitude_deg = 0, longitude_deg = 0;
};

/// Easting and northing in metres.
struct GridPoint {
  double x_m = 0, y_m = 0;
};

/// A zone of the Universal Transverse Mercator projection.
struct UtmZone {
  int number = 31;  // 1 to 60
  bool is_south = false;
};

/// The zone of a place, with the exceptions about Norway and Svalbard. Latitudes in [-80, 84].
UtmZone utm_zone_of(const GeoPoint& place);

/// The place in a zone, which need not be its own: Krueger's series in the third flattening to the sixth order, whose
/// error is below 1e-6 m within 3000 km of the central meridian (Karney, Transverse Mercator with an accuracy of a few
/// nanometers, 2011).
GridPoint to_utm(const GeoPoint& place, const UtmZone& zone);

/// What an MGRS code like 54SVE8155012345 names.
struct MgrsPlace {
  UtmZone zone;
  GridPoint square_m;  // the south-west corner of its square of 100 km, in the zone
  GridPoint offset_m;  // within the square, from the digits: as precise as they are many
};

/// Nothing unless the text is a code of a zone, a band, a square, and at most ten digits, which exists.
std::optional<MgrsPlace> parse_mgrs(std::string_view code);

/// "+proj=utm ..." of coordinates that are UTM's minus `shift`.
std::string proj_string_of(const UtmZone& zone, const GridPoint& shift_m);

}  // namespace pictura
