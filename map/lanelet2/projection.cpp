#include "pictura/map/lanelet2/projection.h"

#include <array>
#include <cmath>
#include <cstddef>
#include <numbers>

#include "pictura/common/error.h"
#include "pictura/common/hypot.h"

namespace pictura {

namespace {

constexpr double kDegree_rad = std::numbers::pi / 180;
constexpr double kScale = 0.9996, kFalseEasting_m = 500e3, kFalseNorthing_m = 10'000e3;  // constants of UTM
constexpr double kSquare_m = 100e3, kRowCycle_m = 2'000e3;                               // constants of MGRS
constexpr double kSemiMajorAxis_m = 6378137.0, kFlattening = 1 / 298.257223563;          // constants of WGS 84

double central_meridian_deg(const UtmZone& zone) { return 6.0 * zone.number - 183; }

/// Returns the index of an MGRS letter among the 24 letters without I and O; -1 for other characters.
int mgrs_letter(char c) {
  if (c < 'A' || c > 'Z' || c == 'I' || c == 'O') return -1;
  return c - 'A' - (c > 'I' ? 1 : 0) - (c > 'O' ? 1 : 0);
}

}  // namespace

UtmZone utm_zone_of(const GeoPoint& place) {
  const double lat = place.latitude_deg, lon = std::remainder(place.longitude_deg, 360);
  int number = static_cast<int>(std::floor((lon + 180) / 6)) % 60 + 1;
  if (lat >= 56 && lat < 64 && lon >= 3 && lon < 12) number = 32;
  if (lat >= 72 && lon >= 0 && lon < 42) number = lon < 9 ? 31 : lon < 21 ? 33 : lon < 33 ? 35 : 37;
  return {number, lat < 0};
}

GridPoint to_utm(const GeoPoint& place, const UtmZone& zone) {
  constexpr double n = kFlattening / (2 - kFlattening);
  constexpr double n2 = n * n, n3 = n2 * n, n4 = n3 * n, n5 = n4 * n, n6 = n5 * n;
  constexpr double rectifying_radius_m = kSemiMajorAxis_m / (1 + n) * (1 + n2 / 4 + n4 / 64 + n6 / 256);
  constexpr std::array<double, 6> alpha{
      n / 2 - n2 * 2 / 3 + n3 * 5 / 16 + n4 * 41 / 180 - n5 * 127 / 288 + n6 * 7891 / 37800,
      n2 * 13 / 48 - n3 * 3 / 5 + n4 * 557 / 1440 + n5 * 281 / 630 - n6 * 1983433 / 1935360,
      n3 * 61 / 240 - n4 * 103 / 140 + n5 * 15061 / 26880 + n6 * 167603 / 181440,
      n4 * 49561 / 161280 - n5 * 179 / 168 + n6 * 6601661 / 7257600,
      n5 * 34729 / 80640 - n6 * 3418889 / 1995840,
      n6 * 212378941 / 319334400,
  };
  const double eccentricity = std::sqrt(kFlattening * (2 - kFlattening));
  const double lat = place.latitude_deg * kDegree_rad;
  const double lon = std::remainder(place.longitude_deg - central_meridian_deg(zone), 360) * kDegree_rad;
  const double tau = std::tan(lat);
  const double sigma = std::sinh(eccentricity * std::atanh(eccentricity * std::sin(lat)));
  const double conformal = tau * hypot_of(1, sigma) - sigma * hypot_of(1, tau);
  const double xi0 = std::atan2(conformal, std::cos(lon));
  const double eta0 = std::asinh(std::sin(lon) / hypot_of(conformal, std::cos(lon)));
  double xi = xi0, eta = eta0;
  for (std::size_t j = 0; j < alpha.size(); ++j) {
    const double k = 2.0 * static_cast<double>(j + 1);
    xi += alpha[j] * std::sin(k * xi0) * std::cosh(k * eta0);
    eta += alpha[j] * std::cos(k * xi0) * std::sinh(k * eta0);
  }
  return {kFalseEasting_m + kScale * rectifying_radius_m * eta,
          (zone.is_south ? kFalseNorthing_m : 0) + kScale * rectifying_radius_m * xi};
}

std::optional<MgrsPlace> parse_mgrs(std::string_view code) {
  std::size_t at = 0;
  int number = 0;
  while (at < code.size() && at < 2 && code[at] >= '0' && code[at] <= '9') number = 10 * number + (code[at++] - '0');
  if (number < 1 || number > 60 || code.size() < at + 3) return std::nullopt;
  const int band = mgrs_letter(code[at]), column = mgrs_letter(code[at + 1]), row = mgrs_letter(code[at + 2]);
  constexpr int kBandC = 2, kBandN = 12, kBandX = 21, kRows = 20;
  if (band < kBandC || band > kBandX || column < 0 || row < 0 || row >= kRows) return std::nullopt;
  // Each zone has eight column letters, which repeat every three zones. Row letters repeat every 2000 km. Rows of even
  // zones begin with F.
  const int easting = column - 8 * ((number - 1) % 3);
  if (easting < 0 || easting >= 8) return std::nullopt;
  MgrsPlace place;
  place.zone = {number, band < kBandN};
  place.square_m.x_m = (easting + 1) * kSquare_m;
  const double in_cycle_m = ((row + (number % 2 == 0 ? kRows - 5 : 0)) % kRows) * kSquare_m;
  // The code means the square with this row letter that overlaps the band. Bands are 8 degrees high, but the
  // northernmost is 12 degrees high.
  const double south_deg = 8.0 * (band - kBandN), north_deg = south_deg + (band == kBandX ? 12 : 8);
  const double meridian_deg = central_meridian_deg(place.zone);
  const double low_m = to_utm({south_deg, meridian_deg}, place.zone).y_m - kSquare_m;
  const double high_m = to_utm({north_deg, meridian_deg + 3}, place.zone).y_m + kSquare_m;
  place.square_m.y_m = in_cycle_m + kRowCycle_m * std::ceil((low_m - in_cycle_m) / kRowCycle_m);
  if (place.square_m.y_m > high_m) return std::nullopt;
  const std::string_view digits = code.substr(at + 3);
  if (digits.size() % 2 != 0 || digits.size() > 10) return std::nullopt;
  double unit_m = kSquare_m;
  for (std::size_t i = 0; i < digits.size() / 2; ++i) {
    const char x = digits[i], y = digits[digits.size() / 2 + i];
    if (x < '0' || x > '9' || y < '0' || y > '9') return std::nullopt;
    unit_m /= 10;
    place.offset_m.x_m += unit_m * (x - '0');
    place.offset_m.y_m += unit_m * (y - '0');
  }
  return place;
}

std::string proj_string_of(const UtmZone& zone, const GridPoint& shift_m) {
  if (shift_m.x_m == 0 && shift_m.y_m == 0) {
    return fmt::format("+proj=utm +zone={}{} +datum=WGS84 +units=m +no_defs", zone.number,
                       zone.is_south ? " +south" : "");
  }
  return fmt::format("+proj=tmerc +lat_0=0 +lon_0={} +k={} +x_0={:.4f} +y_0={:.4f} +datum=WGS84 +units=m +no_defs",
                     central_meridian_deg(zone), kScale, kFalseEasting_m - shift_m.x_m,
                     (zone.is_south ? kFalseNorthing_m : 0) - shift_m.y_m);
}

}  // namespace pictura
