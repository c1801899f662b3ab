#include "pictura/map/procedural/cross_section.h"

namespace pictura::town {

namespace {

using opendrive::Cubic;
using opendrive::FileLane;
using opendrive::FileSection;
using opendrive::Profile;

constexpr double kSlipTaper_m = 14;
constexpr double kMarkWidth_m = 0.12;

/// Returns a cubic step from one width to another over `length_m`, which starts at s.
Cubic step(double s, double from_m, double to_m, double length_m) {
  const double rise = to_m - from_m;
  return {s, from_m, 0, 3 * rise / (length_m * length_m), -2 * rise / (length_m * length_m * length_m)};
}

Profile parking_bay(double width_m, double length_m) {
  return {{{0, 0, 0, 0, 0},
           step(kParkingLead_m, 0, width_m, kParkingTaper_m),
           {kParkingLead_m + kParkingTaper_m, width_m, 0, 0, 0},
           step(length_m - kParkingLead_m - kParkingTaper_m, width_m, 0, kParkingTaper_m),
           {length_m - kParkingLead_m, 0, 0, 0, 0}}};
}

Profile width_of(LaneKind kind, double length_m, bool left, const SectionStyle& style) {
  switch (kind) {
    case LaneKind::median: return {{{0, kHalfMedian_m, 0, 0, 0}}};
    case LaneKind::driving:
      if (style.driving_from_m == style.driving_middle_m && style.driving_middle_m == style.driving_to_m) {
        return {{{0, style.driving_from_m, 0, 0, 0}}};
      }
      return {{step(0, style.driving_from_m, style.driving_middle_m, 0.5 * length_m),
               step(0.5 * length_m, style.driving_middle_m, style.driving_to_m, 0.5 * length_m)}};
    case LaneKind::slip:
      if (left) {
        return {
            {{0, style.driving_from_m, 0, 0, 0}, step(length_m - kSlipTaper_m, style.driving_from_m, 0, kSlipTaper_m)}};
      }
      return {{step(0, 0, style.driving_from_m, kSlipTaper_m), {kSlipTaper_m, style.driving_from_m, 0, 0, 0}}};
    case LaneKind::parking: return parking_bay(kParkingWidth_m, length_m);
    case LaneKind::shoulder: return {{{0, kShoulderWidth_m, 0, 0, 0}}};
    case LaneKind::sidewalk: return {{{0, kSidewalkWidth_m, 0, 0, 0}}};
  }
  return {};
}

struct TypeName {
  const char* name;
  LaneType type;
};

TypeName type_of(LaneKind kind) {
  switch (kind) {
    case LaneKind::median: return {"median", LaneType::median};
    case LaneKind::driving: return {"driving", LaneType::driving};
    case LaneKind::slip: return {"exit", LaneType::ramp};  // OpenDRIVE 1.4's type of a diverging lane
    case LaneKind::parking: return {"parking", LaneType::parking};
    case LaneKind::shoulder: return {"shoulder", LaneType::shoulder};
    case LaneKind::sidewalk: return {"sidewalk", LaneType::sidewalk};
  }
  return {"none", LaneType::other};
}

opendrive::RoadMark make_mark(const char* type) {
  opendrive::RoadMark mark;
  mark.type = type;
  mark.width = mark.type == "none" ? 0 : kMarkWidth_m;
  mark.lane_change = opendrive::LaneChange::none;
  return mark;
}

/// Returns the mark on a lane's outer border.
opendrive::RoadMark outer_mark(const Side& side, int rank, const SectionStyle& style) {
  const LaneKind kind = side.kind_at(rank);
  if (kind == LaneKind::shoulder) return make_mark("curb");
  if (kind == LaneKind::median) {
    opendrive::RoadMark mark = make_mark("solid");
    mark.color = MarkColor::yellow;
    return mark;
  }
  if (style.in_junction || (kind != LaneKind::driving && kind != LaneKind::slip)) {
    return make_mark("none");
  }
  const LaneKind next = rank < side.count() ? side.kind_at(rank + 1) : LaneKind::shoulder;
  const bool may_change = next == LaneKind::driving || next == LaneKind::slip;
  opendrive::RoadMark mark = make_mark(may_change ? "broken" : "solid");
  mark.lane_change = may_change ? opendrive::LaneChange::both : opendrive::LaneChange::none;
  return mark;
}

std::vector<FileLane> make_side(const Side& side, bool left, double length_m, const SectionStyle& style) {
  std::vector<FileLane> lanes;
  for (int rank = 1; rank <= side.count(); ++rank) {
    const LaneKind kind = side.kind_at(rank);
    FileLane& lane = lanes.emplace_back();
    lane.id = left ? rank : -rank;
    lane.type_name = type_of(kind).name;
    lane.type = type_of(kind).type;
    lane.width = width_of(kind, length_m, left, style);
    lane.marks.push_back(outer_mark(side, rank, style));
  }
  return lanes;
}

}  // namespace

int Side::count() const {
  return driving + (has_median ? 1 : 0) + (has_slip ? 1 : 0) + (has_parking ? 1 : 0) + (has_shoulder ? 1 : 0) +
         (has_sidewalk ? 1 : 0);
}

LaneKind Side::kind_at(int rank) const {
  if (has_median && rank-- == 1) return LaneKind::median;
  if (rank <= driving) return LaneKind::driving;
  for (const auto& [kind, exists] :
       {std::pair{LaneKind::slip, has_slip}, std::pair{LaneKind::parking, has_parking},
        std::pair{LaneKind::shoulder, has_shoulder}, std::pair{LaneKind::sidewalk, has_sidewalk}}) {
    rank -= exists ? 1 : 0;
    if (exists && rank == driving) return kind;
  }
  return LaneKind::sidewalk;
}

int Side::rank(LaneKind kind, int index) const {
  const int inside = has_median ? 1 : 0;
  if (kind == LaneKind::driving) return index < driving ? inside + index + 1 : 0;
  if (kind == LaneKind::median) return inside;
  for (int rank = inside + driving + 1; rank <= count(); ++rank) {
    if (kind_at(rank) == kind) return rank;
  }
  return 0;
}

FileSection make_section(double s, double end, const Side& left, const Side& right, const SectionStyle& style) {
  FileSection section;
  section.s = s;
  section.end = end;
  section.center.type_name = "none";
  const bool is_plain = style.in_junction || style.one_way || right.has_median;
  opendrive::RoadMark middle = make_mark(is_plain ? "none" : right.driving > 1 ? "solid solid" : "broken");
  middle.color = is_plain ? MarkColor::white : MarkColor::yellow;
  section.center.marks.push_back(std::move(middle));
  if (!style.one_way) section.left = make_side(left, true, end - s, style);
  section.right = make_side(right, false, end - s, style);
  return section;
}

void link_sections(FileSection* before, const Side& before_left, const Side& before_right, FileSection* after,
                   const Side& after_left, const Side& after_right) {
  const auto link = [](std::vector<FileLane>* lanes, const Side& side, std::vector<FileLane>* next_lanes,
                       const Side& next, int sign) {
    for (int rank = 1; rank <= side.count(); ++rank) {
      const LaneKind kind = side.kind_at(rank);
      const int next_rank = next.rank(kind, side.index_at(rank));
      if (next_rank == 0) continue;
      (*lanes)[rank - 1].successors = {sign * next_rank};
      (*next_lanes)[next_rank - 1].predecessors = {sign * rank};
    }
  };
  link(&before->left, before_left, &after->left, after_left, 1);
  link(&before->right, before_right, &after->right, after_right, -1);
}

}  // namespace pictura::town
