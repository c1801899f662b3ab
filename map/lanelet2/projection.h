// Projections from latitude and longitude to metres, as Lanelet2 maps use them: UTM, and squares of MGRS.
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

/// Returns the zone of a place, including the exceptions for Norway and Svalbard. The latitude must be in [-80, 84].
UtmZone utm_zone_of(const GeoPoint& place);

/// Returns the coordinates of a place in a zone. The place may be outside the zone. Uses Krueger's series up to the
/// sixth order of the third flattening. Its error is below 1e-6 m within 3000 km of the zone's central meridian
/// (Karney, Transverse Mercator with an accuracy of a few nanometers, 2011).
GridPoint to_utm(const GeoPoint& place, const UtmZone& zone);

/// Place of an MGRS code, such as 54SVE8155012345.
struct MgrsPlace {
  UtmZone zone;
  GridPoint square_m;  // south-west corner of the place's 100 km square, in the zone
  GridPoint offset_m;  // offset within the square; the code's digits determine its resolution
};

/// Returns the place of an MGRS code, which consists of zone, band, square and at most ten digits. Returns nullopt if
/// the text is not such a code, or if the square does not exist.
std::optional<MgrsPlace> parse_mgrs(std::string_view code);

/// Returns the PROJ string for UTM coordinates from which `shift_m` is subtracted.
std::string proj_string_of(const UtmZone& zone, const GridPoint& shift_m);

}  // namespace pictura
