#include "pictura/map/opendrive/extent.h"

#include <cmath>
#include <cstddef>
#include <set>

#include "pictura/map/opendrive/curves.h"
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

namespace {

// Negative widths up to this magnitude count as 0 and are not recorded. They occur where a lane tapers off, because
// writers round numbers.
constexpr double kWidthTolerance_m = 0.01;
constexpr double kMaxWidth_m = 500;
constexpr double kMaxBanking_rad = 1.4;
// Number of probes between two stations, between which all quantities are cubics of s. The values at both ends and at
// the probes bound a cubic up to a small factor.
constexpr int kProbes = 4;

template <typename Probe>
void at_probes(const std::vector<double>& stations, Probe&& probe) {
  for (std::size_t i = 1; i < stations.size(); ++i) {
    for (int k = 0; k <= kProbes; ++k) probe(stations[i - 1] + k * (stations[i] - stations[i - 1]) / kProbes);
  }
}

/// Checks the widths of a lane. Records the repair of negative widths once per <lane>, though several sections may have
/// copies of it. `recorded` has the offsets of elements whose repair is recorded.
void check_widths(const FileRoad& road, const FileSection& section, const FileLane& lane,
                  std::set<std::ptrdiff_t>* recorded, Faults* faults) {
  at_probes(formula_changes(road, section, lane.id, section.s, section.end), [&](double s) {
    const double ds = std::min(s, section.end - 1e-6) - section.s;
    const double width =
        lane.border.cubics.empty()
            ? lane.width.value(ds)
            : (lane.id > 0 ? 1 : -1) * (lane.border.value(ds) - border_at(road, section, inner_border(lane.id), s).t);
    if (!(width <= kMaxWidth_m)) {
      lane.where.fail("its width at s {:.3f} is {:.3f} m; expected at most {}", s, width, kMaxWidth_m);
    }
    if (width >= -kWidthTolerance_m || !recorded->insert(lane.where.offset).second) return;
    lane.where.record_repair(faults, RepairKind::negative_width,
                             "its width at s {:.3f} is {:.3f} m; expected at least 0", s, width);
  });
}

void check_position(const FileRoad& road, const FileSection& section, int border, double s) {
  const double t = border_at(road, section, border, s).t;
  const double roll = road.superelevation.value(s);
  const double fall = std::max(std::abs(road.left_crossfall.value(s)), std::abs(road.right_crossfall.value(s)));
  if (!(std::abs(roll) <= kMaxBanking_rad && fall <= kMaxBanking_rad)) {
    road.where.fail("at s {:.3f} it is banked by {} rad; expected at most {}", s, std::max(std::abs(roll), fall),
                    kMaxBanking_rad);
  }
  const double z = point_at(road, s, t).z();
  if (!(std::abs(t) <= kMaxOffset_m && std::abs(z) <= kMaxHeight_m)) {
    road.where.fail("at s {:.3f} a lane border is {} m to its side at a height of {} m; expected at most {} and {} m",
                    s, t, z, kMaxOffset_m, kMaxHeight_m);
  }
}

}  // namespace

void check_extent(const FileRoad& road, Faults* faults) {
  std::set<std::ptrdiff_t> recorded;
  for (const FileSection& section : road.sections) {
    for (const std::vector<FileLane>* side : {&section.left, &section.right}) {
      for (const FileLane& lane : *side) check_widths(road, section, lane, &recorded, faults);
    }
    for (const int border : {static_cast<int>(section.left.size()), -static_cast<int>(section.right.size())}) {
      at_probes(formula_changes(road, section, border, section.s, section.end),
                [&](double s) { check_position(road, section, border, s); });
    }
  }
}

}  // namespace pictura::opendrive
