// Projections of Lanelet2 maps to metres: UTM and MGRS.
#pragma once

#include <optional>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"

namespace pictura {

/// A place on the WGS 84 ellipsoid.
struct GeoPoint {
  double latitude_deg = 0, longitude_deg = 0;
};

/// Easting and northing in metres.
struct GridPoint {
  double x_m = 0, y_m = 0;
};

struct UtmZone {
  int number = 31;  // 1 to 60
  bool is_south = false;
};

/// The latitude must be in [-80, 84].
UtmZone utm_zone_of(const GeoPoint& place);

/// Projects a place, which may be outside the zone. The error is below 1e-6 m within 3000 km of the zone's central
/// meridian (Karney, Transverse Mercator with an accuracy of a few nanometers, 2011).
GridPoint to_utm(const GeoPoint& place, const UtmZone& zone);

/// Place of an MGRS code, such as 54SVE8155012345.
struct MgrsPlace {
  UtmZone zone;
  GridPoint square_m;  // south-west corner of the 100 km square, in the zone
  GridPoint offset_m;  // within the square
};

/// A code has a zone, a band, a square and at most ten digits. Returns nullopt for other texts and unknown squares.
std::optional<MgrsPlace> parse_mgrs(std::string_view code);

/// Returns the PROJ string for UTM coordinates minus `shift_m`.
std::string proj_string_of(const UtmZone& zone, const GridPoint& shift_m);

}  // namespace pictura
