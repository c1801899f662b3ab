// Synthetic scenes for tests and benchmarks of renderers: streets with lane marks, edges, crosswalks, cars, people,
// walls and lights, random by seed, with disjoint footprints.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

/// Appends the outline of a ring or line as strips of this kind.
void add_polyline(StaticGeometry* geometry, std::vector<Vec3> points_m, float width_m, StripKind kind);

/// A town-like scene: a grid of streets 60 m apart, crosswalks and lights at crossings, walls along blocks, and
/// `num_agents` agents on the streets, without contact.
struct Snapshot {
  StaticGeometry geometry;
  SceneOwner scene;  // one world with handle 0
  std::vector<View> views;
};
Snapshot make_synthetic_town(uint64_t seed, int num_agents);

/// Makes a town of strips and walls with a crowd of 900 people, seen from above and along it: far more than the
/// kernels' shared memory can hold.
Snapshot make_crowd();

/// Four worlds on two towns: the second town, the first without agents, the first, and the second again without lights.
/// The empty world has one view. Each other world has three views, each of which hides another third of the town's
/// egos.
struct SyntheticWorlds {
  std::vector<StaticGeometry> maps;
  SceneOwner scene;
  std::vector<View> views;
};
SyntheticWorlds make_synthetic_worlds();

/// Makes a bridge across the view, with marks and cars on it, above a road with marks and cars: seen from the road,
/// from the bridge, and from above.
Snapshot make_bridge();

/// Makes a road that climbs by 12 %, with marks, a stop line, a bridge over it, walls along it, lights, and upright
/// agents on it: seen uphill, downhill, and across from the bridge.
Snapshot make_hill();

/// Makes cars that have driven into others, in front of a wall that one car has driven into; seen from both sides.
Snapshot make_crash();

/// Returns one camera at the origin of the ego frame, 1.5 m up, facing ahead, with round numbers.
Rig simple_rig(int width_px = 100, int height_px = 100, float focal_px = 50);

/// Returns the first camera of the paper's rig alone.
Rig front_rig(int width_px = 96, int height_px = 54);

/// Returns four cameras of 97x55, 1x1 and 40x130 pixels.
Rig mixed_rig();

/// Returns eight cameras of eight sizes, pitched and rolled.
Rig eight_camera_rig();

/// Difficult scenes, each with a rig: hills, bridges, intersecting solids, odd sizes, one pixel.
struct HardScene {
  std::string name;
  Snapshot town;
  Rig rig;
};
std::vector<HardScene> hard_scenes();

/// All images of a batch, camera by camera: colours as floats, and planes if requested.
struct Outputs {
  std::vector<float> color;
  std::vector<float> depth_m;
  std::vector<uint8_t> class_id;
  std::vector<uint16_t> instance_id;
  bool operator==(const Outputs&) const = default;
};
/// Uploads the maps and draws all views.
Outputs draw_outputs(Renderer* renderer, const Snapshot& town, Planes planes);
Outputs draw_outputs(Renderer* renderer, const SyntheticWorlds& worlds, Planes planes);

}  // namespace pictura
