// Changes that must leave an image unchanged: moving or mirroring the whole world, dividing lines, adding hidden
// agents, and changing the number of threads or the order of the input.
#include <algorithm>
#include <cmath>
#include <random>

#include "pictura/bench/truth/tolerances.h"
#include "pictura/tests/support/image_drawing.h"

namespace pictura {
namespace {

// Returns the area of the points' convex hull, by A. Andrew's monotone chain.
double hull_area(std::vector<Vec2> points) {
  std::sort(points.begin(), points.end(), [](Vec2 a, Vec2 b) { return a.x < b.x || (a.x == b.x && a.y < b.y); });
  std::vector<Vec2> hull;
  for (int side = 0; side < 2; ++side) {
    const std::size_t begin = hull.size();
    for (const Vec2 p : points) {
      while (hull.size() >= begin + 2 && cross(hull.back() - hull[hull.size() - 2], p - hull.back()) <= 0)
        hull.pop_back();
      hull.push_back(p);
    }
    hull.pop_back();
    std::reverse(points.begin(), points.end());
  }
  double twice_area = 0;
  for (std::size_t i = 0; i < hull.size(); ++i) twice_area += cross(hull[i], hull[(i + 1) % hull.size()]);
  return 0.5 * std::abs(twice_area);
}

Strip straight_strip(Vec3 a_m, Vec3 b_m, float width_m) {
  const Vec2 along = b_m.xy() - a_m.xy();
  Strip strip;
  strip.a_m = a_m;
  strip.b_m = b_m;
  strip.side_a = strip.side_b = left_normal(along) * (1 / length(along));
  strip.width_m = width_m;
  strip.color = {1, 1, 1};
  return strip;
}

TEST(Invariance, AWallInFrontHidesAnAgentToTheLastBit) {
  StaticGeometry geometry;
  WallFace wall;
  wall.a_m = {10, -8, 0};
  wall.b_m = {10, 8, 0};
  wall.height_m = 6;
  geometry.walls.push_back(wall);
  add_polyline(&geometry, {{2, -1, 0}, {60, -2, 0}}, 0.2f, StripKind::lane_mark);
  geometry.build_grids();
  const AgentBox near = make_box(AgentClass::cyclist, {7, 1, 0}, 0.4f, {1.8f, 0.6f, 1.7f});
  const AgentBox hidden = make_box(AgentClass::vehicle, {20, 2, 0}, 0.4f, {4, 2, 2});
  const std::vector<View> views{make_view({}, 0.05f)};
  const RendererConfig config{.rig = paper_rig(97, 55), .num_threads = 1};
  EXPECT_EQ(draw(geometry, scene_of({near, hidden}), views, config).rgb,
            draw(geometry, scene_of({near}), views, config).rgb);
  // Without the wall the hidden agent is visible.
  const StaticGeometry open = no_geometry();
  EXPECT_NE(draw(open, scene_of({near, hidden}), views, config).rgb, draw(open, scene_of({near}), views, config).rgb);
}

/// Far cars behind a wall of many pieces: slivers of the cars lie in pixels that one piece or two pieces together fill.
TEST(Invariance, ObjectsBehindPiecesOfAWallAreInvisible) {
  std::vector<AgentBox> hidden;
  for (int i = 0; i < 40; ++i) {
    const auto at = static_cast<float>(i);
    hidden.push_back(make_box(AgentClass::vehicle, {25 + 2 * at, 1.1f * at - 22, 0}, 0.3f * at, {4.5f, 2, 1.5f}));
  }
  const std::vector<View> views{make_view({}, 0.05f)};
  const RendererConfig config{.rig = paper_rig(32, 18), .num_threads = 1};
  constexpr float kRounding = 1e-6f;  // a pixel of one fragment is not summed
  for (int i = 0; i < 120; ++i) {
    StaticGeometry geometry;
    const float shift_m = 0.017f * static_cast<float>(i);
    for (int piece = 0; piece < 14; ++piece) {
      const auto end = [&](int k) {
        return Vec3{k % 2 ? 10.0f : 11.0f, 2.1f * static_cast<float>(k) - 15 + shift_m, 0};
      };
      WallFace wall;
      wall.a_m = end(piece);
      wall.b_m = end(piece + 1);
      wall.height_m = 9;
      geometry.walls.push_back(wall);
    }
    geometry.build_grids();
    const std::vector<float> with = draw(geometry, scene_of(hidden), views, config).rgb,
                             without = draw(geometry, scene_of({}), views, config).rgb;
    // The front camera sees only the wall.
    for (std::size_t k = 0; k < std::size_t{3} * 32 * 18; ++k) {
      ASSERT_NEAR(with[k], without[k], kRounding) << i << ", " << k;
    }
  }
}

TEST(Invariance, ImagesDoNotDependOnTheNumberOfThreads) {
  const Snapshot town = make_synthetic_town(3, 60);
  std::vector<float> first;
  for (const int threads : {1, 2, 7}) {
    const Drawn images =
        draw(town.geometry, town.scene, town.views, {.rig = paper_rig(48, 27), .num_threads = threads});
    if (first.empty()) first = images.rgb;
    EXPECT_EQ(images.rgb, first) << threads;
  }
}

void expect_close(const std::vector<float>& a, const std::vector<float>& b) {
  ASSERT_EQ(a.size(), b.size());
  std::size_t far = 0;
  double worst = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    const double error = std::abs(static_cast<double>(a[i]) - b[i]);
    worst = std::max(worst, error);
    far += error > 1.0 / 255;
  }
  EXPECT_LE(worst, kMovedSceneError);
  EXPECT_LE(static_cast<double>(far), kMovedSceneShare * static_cast<double>(a.size()));
}

constexpr SinCos kNoTurn{.sin = 0, .cos = 1};

// Returns the town moved by a rotation about z, a shift, or a mirroring of y.
Snapshot moved(const Snapshot& town, SinCos turn, Vec3 shift_m, bool mirror) {
  auto direction = [&](Vec2 v) {
    if (mirror) v.y = -v.y;
    return Vec2{v.x * turn.cos - v.y * turn.sin, v.x * turn.sin + v.y * turn.cos};
  };
  auto transformed = [&](Vec3 p) {
    const Vec2 turned = direction(p.xy());
    return Vec3{turned.x, turned.y, p.z} + shift_m;
  };
  Snapshot out = town;
  for (Strip& strip : out.geometry.strips) {
    strip.a_m = transformed(strip.a_m);
    strip.b_m = transformed(strip.b_m);
    strip.side_a = direction(strip.side_a);
    strip.side_b = direction(strip.side_b);
  }
  for (WallFace& wall : out.geometry.walls) {
    wall.a_m = transformed(wall.a_m);
    wall.b_m = transformed(wall.b_m);
  }
  for (LightHead& head : out.geometry.heads) {
    head.position_m = transformed(head.position_m);
    head.facing = direction(head.facing);
  }
  out.geometry.build_grids();
  for (AgentBox& box : out.scene.agents) {
    box.center_m = transformed(box.center_m);
    const Vec2 heading = direction({box.cos_heading, box.sin_heading});
    box.cos_heading = heading.x;
    box.sin_heading = heading.y;
  }
  for (View& view : out.views) {
    view.origin_m = transformed(view.origin_m);
    const Vec2 heading = direction({view.cos_heading, view.sin_heading});
    view.cos_heading = heading.x;
    view.sin_heading = heading.y;
  }
  return out;
}

TEST(Invariance, MovingTheWorldChangesNothing) {
  Snapshot town = make_synthetic_town(4, 80);
  town.views.resize(6);
  const RendererConfig config{.rig = paper_rig(), .num_threads = 1};
  const std::vector<float> here = draw(town.geometry, town.scene, town.views, config).rgb;
  const Snapshot shifted = moved(town, kNoTurn, {256, -512, 32}, false);
  expect_close(draw(shifted.geometry, shifted.scene, shifted.views, config).rgb, here);
  const Snapshot turned = moved(town, sincos_of(1.1f), {}, false);
  expect_close(draw(turned.geometry, turned.scene, turned.views, config).rgb, here);
}

TEST(Invariance, AQuarterTurnOfTheWorldChangesNoBit) {
  // The turn is exact, because it only swaps coordinates and their signs.
  Snapshot town = make_synthetic_town(4, 80);
  town.views.resize(6);
  const RendererConfig config{.rig = paper_rig(), .num_threads = 1};
  const std::vector<float> here = draw(town.geometry, town.scene, town.views, config).rgb;
  const Snapshot turned = moved(town, {.sin = 1, .cos = 0}, {}, false);
  EXPECT_EQ(draw(turned.geometry, turned.scene, turned.views, config).rgb, here);
}

TEST(Invariance, AMirroredWorldGivesMirroredImages) {
  Snapshot town = make_synthetic_town(6, 80);
  // Faces to the left and right differ in colour; walls and marks do not.
  town.scene = scene_of({});
  town.scene.light_begin = {0, 0};
  town.views.resize(4);
  for (View& view : town.views) view.ego_agent = -1;
  RendererConfig config{.rig = simple_rig(96, 54, 77), .num_threads = 1};
  const Drawn here = draw(town.geometry, town.scene, town.views, config);
  const Snapshot mirrored = moved(town, kNoTurn, {}, true);
  Drawn there = draw(mirrored.geometry, mirrored.scene, mirrored.views, config);
  for (std::size_t row = 0; row < there.rgb.size() / 96; ++row) {
    std::reverse(there.rgb.begin() + static_cast<std::ptrdiff_t>(96 * row),
                 there.rgb.begin() + static_cast<std::ptrdiff_t>(96 * (row + 1)));
  }
  // Samples are not mirrored, so pixels shared by several objects differ by the oracle's own error.
  double worst = 0;
  for (std::size_t i = 0; i < there.rgb.size(); ++i) {
    worst = std::max(worst, std::abs(static_cast<double>(there.rgb[i]) - here.rgb[i]));
  }
  EXPECT_LE(worst, kWorstOracleError);
}

TEST(Invariance, ImagesDoNotDependOnTheOrderOfTheInput) {
  Snapshot town = make_synthetic_town(8, 100);
  town.views.resize(4);
  for (View& view : town.views) view.ego_agent = -1;
  const RendererConfig config{.rig = paper_rig(), .num_threads = 1};
  const std::vector<float> before = draw(town.geometry, town.scene, town.views, config).rgb;
  std::mt19937 random(1);
  std::shuffle(town.scene.agents.begin(), town.scene.agents.end(), random);
  std::shuffle(town.geometry.walls.begin(), town.geometry.walls.end(), random);
  std::shuffle(town.geometry.heads.begin(), town.geometry.heads.end(), random);
  // The index orders strips of one kind. So these strips keep their order; only the order of kinds changes.
  std::stable_sort(town.geometry.strips.begin(), town.geometry.strips.end(),
                   [](const Strip& a, const Strip& b) { return a.kind > b.kind; });
  town.geometry.build_grids();
  EXPECT_EQ(draw(town.geometry, town.scene, town.views, config).rgb, before);
}

// Returns the covered area in pixels, in a scene where everything has one colour.
double covered_px(const Drawn& image, float color) {
  double sum = 0;
  for (int y = 0; y < image.height_px; ++y) {
    for (int x = 0; x < image.width_px; ++x) sum += image.at(x, y).r;
  }
  return sum / static_cast<double>(color);
}

TEST(Invariance, TheFacesOfABoxSumToItsSilhouette) {
  // Coverage is the share of a pixel that does not show the green wall behind the box, less the box's own green.
  StaticGeometry geometry;
  WallFace wall;
  wall.a_m = {30, -90, -30};
  wall.b_m = {30, 90, -30};
  wall.height_m = 80;
  wall.color = {0, 1, 0};
  geometry.walls.push_back(wall);
  geometry.build_grids();
  const float behind = 1 - 30.0f / 120;
  for (int i = 0; i < 12; ++i) {
    const AgentBox box =
        make_box(AgentClass::vehicle, {9, 0.2f, 0}, 0.3f + 0.5f * static_cast<float>(i), {4, 1.8f, 1.2f});
    const Drawn with = draw(geometry, scene_of({box}), {make_view({}, 0)}, {.rig = simple_rig(), .num_threads = 1});
    const Drawn alone =
        draw(no_geometry(), scene_of({box}), {make_view({}, 0)}, {.rig = simple_rig(), .num_threads = 1});
    // The silhouette is the hull of the projected corners.
    std::vector<Vec2> corners;
    for (int corner = 0; corner < 8; ++corner) {
      const Vec2 ahead{box.cos_heading, box.sin_heading};
      const Vec2 ground =
          box.center_m.xy() + ahead * (corner & 1 ? 2.0f : -2.0f) + left_normal(ahead) * (corner & 2 ? 0.9f : -0.9f);
      const float z = corner & 4 ? 1.2f : 0.0f;
      corners.push_back({50 - 50 * ground.y / ground.x, 50 - 50 * (z - 1.5f) / ground.x});
    }
    const double silhouette_px = hull_area(corners);
    // The faces cover the hidden part of the wall.
    double hidden_px = 0;
    for (int y = 0; y < 100; ++y) {
      for (int x = 0; x < 100; ++x) hidden_px += (behind - (with.at(x, y).g - alone.at(x, y).g)) / behind;
    }
    EXPECT_NEAR(hidden_px, silhouette_px, kSilhouetteError * silhouette_px) << i;
  }
}

TEST(Invariance, TwoPiecesOfALineCoverAsMuchAsTheWholeLine) {
  // Each piece has one brightness, so the line lies across the view, at one depth.
  for (const float tilt : {0.0f, 0.05f}) {
    const Vec3 a{20, 8, 0}, b{20, -6, tilt * 14};
    StaticGeometry whole, halves;
    whole.strips.push_back(straight_strip(a, b, 0.4f));
    const Vec3 middle = (a + b) * 0.5f;
    halves.strips.push_back(straight_strip(a, middle, 0.4f));
    halves.strips.push_back(straight_strip(middle, b, 0.4f));
    whole.build_grids();
    halves.build_grids();
    const RendererConfig config{.rig = simple_rig(97, 55, 60), .num_threads = 1};
    const Drawn one = draw(whole, scene_of({}), {make_view({}, 0)}, config);
    const Drawn two = draw(halves, scene_of({}), {make_view({}, 0)}, config);
    EXPECT_GT(covered_px(one, 1), 10);
    for (std::size_t i = 0; i < one.rgb.size(); ++i) ASSERT_NEAR(one.rgb[i], two.rgb[i], kSplitLineError) << tilt;
  }
}

}  // namespace
}  // namespace pictura
