// Small random scenes in which two surfaces have nearly the same depth, or an exception to a drawing rule applies.
#pragma once

#include <iterator>

#include "pictura/bench/truth/image_scenes.h"

namespace pictura {

enum class RandomKind {
  near_plane,          // strips that cross the near plane of a camera close to the road
  bridge_from_below,   // cars and walls on a bridge or a ramp, seen from the road below
  crashed_boxes,       // boxes driven into each other, with faces in one plane
  intersecting_walls,  // walls that cross each other, partly behind boxes
  wide_strips,         // strips widened to at least 2, 4 or 8 px, up to the horizon and beyond
  walls_on_strips,     // walls whose lower edge is up to 40 cm below their strips
  level_edges,         // level edges of walls and boxes, one closely above the other
};
constexpr const char* kRandomKindNames[] = {
    "strips across the near plane", "bridges from below", "crashed boxes", "intersecting walls",
    "strips wider than 2 px",       "walls on strips",    "level edges"};
constexpr int kNumRandomKinds = static_cast<int>(std::size(kRandomKindNames));

/// A scene with one view and one camera at the view's origin, with the image size and focal length of paper_rig().
struct RandomScene {
  Snapshot town;
  RendererConfig config;
};
/// The scene depends only on the arguments.
RandomScene make_random_scene(RandomKind kind, uint64_t seed);

}  // namespace pictura
