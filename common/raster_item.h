// A thing of the scene as an image sees it: its faces on screen, what it occupies, and its place in the order. Shared
// by both devices, which differ only in how they share out the work and where they keep the results.
#pragma once

#include "pictura/common/raster_cull.h"
#include "pictura/common/raster_order.h"

namespace pictura {

/// What one image shows, and how.
struct ImageSetting {
  PinholeCamera camera;  // in the world
  Frustum frustum;
  float line_floor_px = 0;
  bool debug_palette = false;
};

struct RasterItem {
  int32_t face_begin = 0, face_end = 0;
  PixelBox box;
  int32_t agent = -1;          // index into SceneBatch::agents
  uint8_t class_id = 0;        // of the class plane
  bool is_background = false;  // a strip of level ground, which is ordered by key alone
  OrderKey key;
  Extent extent;
};

/// Most faces that a thing shows at once: three of a cuboid.
constexpr int kMaxItemFaces = 3;

// Numbers of things are unique within an image: kind, then index.
constexpr uint32_t kAgentNumber = 0u << 28, kWallNumber = 1u << 28, kLightNumber = 2u << 28, kStripNumber = 3u << 28;

/// Faces of one thing, while they are made.
struct ItemFaces {
  ScreenFace face[kMaxItemFaces];
  int32_t count = 0;
  PixelBox box;
};

/// Clips and projects one face of a thing and appends it. Edges go to a pool: take(count) returns the index of the
/// first, or -1 where there is no room left, and at(index) its address.
template <typename EdgePool>
PICTURA_HD inline void add_face(const ImageSetting& setting, const Vec3* corners, int count, const FacePlane& plane,
                                Rgb color, EdgePool& pool, ItemFaces* faces) {
  Vec3 polygon[kMaxPolygonCorners];
  const int kept = clip_face(setting.frustum, corners, count, polygon);
  if (kept < 3 || faces->count == kMaxItemFaces) return;
  const int32_t edge_begin = pool.take(kept);
  if (edge_begin < 0) return;
  ScreenFace& face = faces->face[faces->count];
  if (!make_screen_face(setting.camera, polygon, kept, plane, color, pool.at(edge_begin), &face)) return;
  face.edge_begin = edge_begin;
  faces->box = faces->count == 0 ? face.box : united(faces->box, face.box);
  ++faces->count;
}

PICTURA_HD inline RasterItem agent_item(const ImageSetting& setting, const AgentBox& box, int32_t agent,
                                        int32_t world_begin) {
  RasterItem item;
  item.agent = agent;
  item.class_id = static_cast<uint8_t>(static_cast<int>(SurfaceClass::vehicle) + static_cast<int>(box.agent_class));
  item.extent = agent_extent(box, setting.camera.position_m);
  item.key = {nearest_distance2(item.extent), kAgentNumber | static_cast<uint32_t>(agent - world_begin)};
  return item;
}

PICTURA_HD inline RasterItem wall_item(const ImageSetting& setting, const WallFace& wall, int32_t index) {
  RasterItem item;
  item.class_id = static_cast<uint8_t>(SurfaceClass::wall);
  item.extent = wall_extent(wall, setting.camera.position_m);
  item.key = {nearest_distance2(item.extent), kWallNumber | static_cast<uint32_t>(index)};
  return item;
}

PICTURA_HD inline RasterItem light_item(const ImageSetting& setting, const LightHead& head, int32_t index) {
  RasterItem item;
  item.class_id = static_cast<uint8_t>(SurfaceClass::light);
  item.extent = light_extent(head, setting.camera.position_m);
  item.key = {nearest_distance2(item.extent), kLightNumber | static_cast<uint32_t>(index)};
  return item;
}

PICTURA_HD inline RasterItem strip_item(const ImageSetting& setting, const Strip& strip, int32_t index) {
  RasterItem item;
  item.class_id = static_cast<uint8_t>(kClassOfStrip + static_cast<int>(strip.kind));
  item.extent = strip_extent(strip, static_cast<uint32_t>(index), setting.camera.position_m);
  item.key = {nearest_distance2(item.extent), kStripNumber | static_cast<uint32_t>(index)};
  return item;
}

/// Heights above the camera of what an image shows: the lowest foot of its solids, and where its strips lie.
struct GroundHeights {
  float lowest_foot_m = 1e30f;
  Interval strips;
};

/// Most that the strips of level ground differ in height.
constexpr float kLevelGround_m = 0.02f;

/// Whether all strips lie on level ground below the camera and no solid reaches below it: then they are of one level
/// and behind all solids, and need no pairwise order.
PICTURA_HD inline bool ground_is_level(const GroundHeights& heights) {
  return heights.strips.high < 0.0f && heights.strips.high - heights.strips.low <= kLevelGround_m &&
         heights.strips.high - heights.lowest_foot_m <= kLevelGround_m;
}

/// Orders a strip of level ground by rank alone.
PICTURA_HD inline void put_in_background(RasterItem* strip) {
  strip->is_background = true;
  strip->key = {0.0f, strip->extent.rank};
}

/// Orders are weighed by what things share on screen, in these parts of a pixel, up to the largest weight; less than
/// one part is nothing.
constexpr float kOrderUnits = 1024.0f;
constexpr float kMaxOrderWeight = 1 << 20;

/// Which of two things of the foreground, whose keys ascend, must be drawn first, being in front: below 0 the nearer,
/// above 0 the farther, 0 they do not meet on screen. The magnitude says how much of the screen depends on it. Of
/// things that intersect, the one that is in front in the middle of what they share goes first.
PICTURA_HD inline int32_t order_on_screen(const RasterItem& nearer, const RasterItem& farther, const ScreenFace* faces,
                                          const PolygonEdge* edges) {
  if (!overlap(nearer.box, farther.box)) return 0;
  const bool both_strips = nearer.extent.is_strip && farther.extent.is_strip;
  float lead_px2 = 0.0f, shared_px2 = 0.0f;  // lead: where the nearer thing is in front, less where the farther is
  for (int32_t i = nearer.face_begin; i < nearer.face_end; ++i) {
    for (int32_t j = farther.face_begin; j < farther.face_end; ++j) {
      if (!overlap(faces[i].box, faces[j].box)) continue;
      const SharedRegion shared = shared_region(faces[i], faces[j], edges);
      if (shared.area_px2 * kOrderUnits < 1.0f) continue;
      const float a = inverse_depth(faces[i], shared.middle_px), b = inverse_depth(faces[j], shared.middle_px);
      // Beyond the horizon a plane is infinitely far.
      bool in_front = max_of(a, 0.0f) >= max_of(b, 0.0f);
      if (both_strips && of_one_level(a, faces[i].plane_distance_m, b, faces[j].plane_distance_m)) {
        in_front = nearer.extent.rank < farther.extent.rank;
      }
      shared_px2 += shared.area_px2;
      lead_px2 += in_front ? shared.area_px2 : -shared.area_px2;
    }
  }
  if (shared_px2 == 0.0f) return 0;
  bool nearer_first = lead_px2 >= 0.0f;
  // A strip in front of a solid that stands on it: the solid dips into the road.
  if (nearer.extent.is_strip != farther.extent.is_strip && nearer_first == nearer.extent.is_strip) {
    const RasterItem &strip = nearer_first ? nearer : farther, &solid = nearer_first ? farther : nearer;
    if (stands_on(solid.extent, strip.extent)) nearer_first = !nearer_first;
  }
  const int32_t weight = static_cast<int32_t>(min_of(shared_px2 * kOrderUnits, kMaxOrderWeight));
  return nearer_first ? -weight : weight;
}

/// What the instance plane says of a thing.
PICTURA_HD inline uint16_t instance_of(const RasterItem& item, int32_t world_begin) {
  return static_cast<uint16_t>(item.agent < 0 ? 0 : 1 + item.agent - world_begin);
}

}  // namespace pictura
