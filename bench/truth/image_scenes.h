// Synthetic scenes for tests and benchmarks of renderers: streets with lane marks, edges, crosswalks, cars, people,
// walls and lights.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

/// Appends a polyline, open or closed, as strips of this kind.
void add_polyline(StaticGeometry* geometry, std::vector<Vec3> points_m, float width_m, StripKind kind);

/// A scene with its views. make_synthetic_town() makes a random town: a grid of streets 60 m apart, crosswalks and
/// lights at crossings, walls along blocks, and num_agents agents, which stand on the streets without touching each
/// other.
struct Snapshot {
  StaticGeometry geometry;
  SceneOwner scene;  // one world with handle 0
  std::vector<View> views;
};
Snapshot make_synthetic_town(uint64_t seed, int num_agents);

/// Makes a town of strips and walls with a crowd of 900 people, seen from above and from the side. The crowd has far
/// more faces than fit into the shared memory of CUDA kernels.
Snapshot make_crowd();

/// Four worlds on two towns: the second town, the first town without agents, the first town, and the second town
/// without lights. The world without agents has one view. Each other world has three views, each of which hides a
/// different third of the town's vehicles.
struct SyntheticWorlds {
  std::vector<StaticGeometry> maps;
  SceneOwner scene;
  std::vector<View> views;
};
SyntheticWorlds make_synthetic_worlds();

/// Makes a bridge with marks and cars over a road with marks and cars, seen from the road, from the bridge, and from
/// above.
Snapshot make_bridge();

/// Makes a road that climbs by 12 %, with marks, a stop line, walls, lights and upright agents, and a bridge over the
/// road. It is seen uphill, downhill, and from the bridge.
Snapshot make_hill();

/// Makes cars that have driven into each other, in front of a wall that one car has driven into. They are seen from
/// both sides.
Snapshot make_crash();

/// Returns a rig of one camera that faces forward, 1.5 m above the origin of the ego frame. Its numbers are round.
Rig simple_rig(int width_px = 100, int height_px = 100, float focal_px = 50);

/// Returns a rig of the first camera of paper_rig().
Rig front_rig(int width_px = 96, int height_px = 54);

/// Returns four cameras: two of 97x55 pixels, one of 1x1 and one of 40x130.
Rig mixed_rig();

/// Returns eight cameras of eight sizes, with different pitch and roll angles.
Rig eight_camera_rig();

/// Difficult scenes, each with a rig: hills, bridges, intersecting solids, odd sizes, one pixel.
struct HardScene {
  std::string name;
  Snapshot town;
  Rig rig;
};
std::vector<HardScene> hard_scenes();

/// All images of a batch, camera by camera: colours as floats, and the optional planes (depth, class, instance).
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
