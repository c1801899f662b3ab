// Synthetic scenes for tests and benchmarks of renderers.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/renderer.h"

namespace pictura {

/// Appends an open or closed polyline as strips.
void add_polyline(StaticGeometry* geometry, std::vector<Vec3> points_m, float width_m, StripKind kind);

/// A scene with its views. make_synthetic_town() makes a random town: streets 60 m apart, crosswalks, lights, walls,
/// and num_agents agents, which do not touch.
struct Snapshot {
  StaticGeometry geometry;
  SceneOwner scene;  // one world with handle 0
  std::vector<View> views;
};
Snapshot make_synthetic_town(uint64_t seed, int num_agents);

/// Makes a crowd of 900 people, seen from above and the side. Its faces exceed a CUDA block's shared memory.
Snapshot make_crowd();

/// Four worlds of two synthetic towns: the second town, the first town without agents (one view), the first town, and
/// the second town without lights. All worlds but the one without agents have three views each, which hide different
/// thirds of the vehicles.
struct SyntheticWorlds {
  std::vector<StaticGeometry> maps;
  SceneOwner scene;
  std::vector<View> views;
};
SyntheticWorlds make_synthetic_worlds();

/// Makes a bridge over a road, both with cars, seen from the road, the bridge and above.
Snapshot make_bridge();

/// Makes a road that climbs by 12 % under a bridge, with upright agents, seen uphill, downhill, and from the bridge.
Snapshot make_hill();

/// Makes cars that have driven into each other and into a wall, seen from both sides.
Snapshot make_crash();

/// One camera that faces forward, 1.5 m above the ego frame's origin.
Rig simple_rig(int width_px = 100, int height_px = 100, float focal_px = 50);

/// The first camera of paper_rig().
Rig front_rig(int width_px = 96, int height_px = 54);

/// Two cameras of 97x55 pixels, one of 1x1 and one of 40x130.
Rig mixed_rig();

/// Cameras of eight sizes, with different pitch and roll angles.
Rig eight_camera_rig();

/// Difficult scenes: hills, bridges, intersecting solids, odd sizes, one pixel.
struct HardScene {
  std::string name;
  Snapshot town;
  Rig rig;
};
std::vector<HardScene> hard_scenes();

/// Images of a batch, camera by camera.
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
