// Conversion of polylines to mitred strips, and renderers by name.
#include "pictura/common/scene.h"

#include <algorithm>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/shapes.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

TEST(Strips, AreAtMostTenMetresAndShareTheirEdges) {
  const std::vector<Vec3> points{{0, 0, 0}, {25, 0, 1}, {25, 10, 1}};
  std::vector<Strip> strips;
  append_strips(points, 0.2f, kWhiteMarkColor, StripKind::lane_mark, &strips);
  ASSERT_EQ(strips.size(), 4u);  // 3 pieces of 25/3 m and one of 10 m
  for (const Strip& strip : strips) EXPECT_LE(length(strip.b_m.xy() - strip.a_m.xy()), kMaxPiece_m + 1e-4f);
  for (size_t i = 1; i < strips.size(); ++i) {
    EXPECT_EQ(strips[i].side_a.x, strips[i - 1].side_b.x);
    EXPECT_EQ(strips[i].side_a.y, strips[i - 1].side_b.y);
  }
  // The mitre of a right angle points to the inner corner: (-1, 1), so that both borders keep their distance of 1.
  EXPECT_NEAR(strips[3].side_a.x, -1, 1e-6);
  EXPECT_NEAR(strips[3].side_a.y, 1, 1e-6);
  EXPECT_NEAR(strips[1].a_m.z, 1.0 / 3, 1e-6);
}

TEST(Strips, RepeatedPointsAreSkippedAndSharpTurnsBounded) {
  const std::vector<Vec3> points{{0, 0, 0}, {0, 0, 0}, {5, 0, 0}, {0, 0.01f, 0}};
  std::vector<Strip> strips;
  append_strips(points, 0.2f, kWhiteMarkColor, StripKind::lane_mark, &strips);
  ASSERT_EQ(strips.size(), 2u);
  EXPECT_LT(length(strips[0].side_b), 4.01f);
  const std::vector<Vec3> single{{1, 2, 3}};
  EXPECT_THROW(append_strips(single, 0.2f, kWhiteMarkColor, StripKind::lane_mark, &strips), Error);
}

TEST(Strips, AreStoredByTheBoxAroundTheirCorners) {
  // A straight end, a right angle, and a turn by 150 degrees.
  const std::vector<Vec3> points{{0, 0, 0}, {8, 0, 0}, {8, 6, 0}, {5.5f, 1.67f, 0}};
  std::vector<Strip> strips;
  append_strips(points, 0.4f, kWhiteMarkColor, StripKind::lane_mark, &strips);
  ASSERT_EQ(strips.size(), 3u);
  EXPECT_GT(length(strips[1].side_b), 3.8f);
  for (const Strip& strip : strips) {
    Vec3 corners[4];
    strip_corners(strip, corners);
    Aabb2 around{corners[0].xy(), corners[0].xy()};
    for (const Vec3& corner : corners) {
      around.low = {min_of(around.low.x, corner.x), min_of(around.low.y, corner.y)};
      around.high = {max_of(around.high.x, corner.x), max_of(around.high.y, corner.y)};
    }
    const Aabb2 box = ground_box(strip);
    EXPECT_EQ(box.low.x, around.low.x);
    EXPECT_EQ(box.low.y, around.low.y);
    EXPECT_EQ(box.high.x, around.high.x);
    EXPECT_EQ(box.high.y, around.high.y);
  }
}

TEST(Renderers, AnUnknownNameListsTheKnownOnes) {
  try {
    make_renderer("vulkan", {});
    FAIL() << "expected an error";
  } catch (const UsageError& error) {
    EXPECT_THAT(error.what(), testing::AllOf(testing::HasSubstr("cpu"), testing::HasSubstr("'vulkan'")));
  }
  EXPECT_THAT(test::message_of([] { make_renderer("vulkan", {.samples = {.grid = 2}}); }),
              testing::HasSubstr("renderer: expected one of cpu"));
}

TEST(Renderers, AutoReportsItsChoice) {
  std::string choice;
  EXPECT_NE(make_renderer("auto", {}, &choice), nullptr);
  EXPECT_THAT(choice, testing::ContainsRegex("^(cpu|cuda): "));
}

TEST(Renderers, NullDrawsBlack) {
  RendererConfig config;
  config.rig = paper_rig(8, 4);
  const auto renderer = make_renderer("null", config);
  HostImages images(config.rig, 2);
  for (uint8_t& byte : images.bytes()) byte = 7;
  const std::vector<View> views(2);
  renderer->render({}, views, images.batch());
  for (const uint8_t byte : images.bytes()) ASSERT_EQ(byte, 0);
  HostImages patches(config.rig, 2, PixelFormat::bf16, Planes::none, ChannelOrder::patches, 12);
  for (uint8_t& byte : patches.bytes()) byte = 7;
  renderer->render({}, views, patches.batch());
  for (const uint8_t byte : patches.bytes()) ASSERT_EQ(byte, 0);
  // ... in the images of the counted views.
  std::fill(images.bytes().begin(), images.bytes().end(), uint8_t{7});
  const int32_t count = 1;
  renderer->render({}, {views, &count}, images.batch());
  const auto half = static_cast<std::ptrdiff_t>(images.bytes().size() / 2);
  EXPECT_TRUE(std::all_of(images.bytes().begin(), images.bytes().begin() + half, [](uint8_t b) { return b == 0; }));
  EXPECT_TRUE(std::all_of(images.bytes().begin() + half, images.bytes().end(), [](uint8_t b) { return b == 7; }));
}

}  // namespace
}  // namespace pictura
