// The text of procedural towns: it is valid OpenDRIVE, roads and lanes meet without gaps, and each option has its
// effect.
#include "pictura/map/procedural/procedural_town.h"

#include <cmath>
#include <set>
#include <string>
#include <vector>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/map/procedural/layout.h"
#include "pictura/tests/map/opendrive_text.h"
#include "pictura/tests/map/town_options.h"
#include "pictura/tests/support/error_message.h"

namespace pictura {
namespace {

using test::is;
using test::LaneEnd;
using test::OpenDriveText;
using test::violated_rules;
using testing::HasSubstr;
using testing::IsEmpty;

/// Options at their defaults, all at their minimum, all at their maximum, and each option at either end.
std::vector<TownOptions> extremes(uint64_t seed) {
  std::vector<TownOptions> all{test::options_of(seed, 3, 3)};
  TownOptions all_low = all[0], all_high = all[0];
  for (const TownFeature& feature : town_features()) {
    all_low.*feature.value = feature.low;
    all_high.*feature.value = feature.high;
    for (const double value : {feature.low, feature.high}) {
      all.push_back(all[0]);
      all.back().*feature.value = value;
    }
  }
  all.push_back(all_low);
  all.push_back(all_high);
  return all;
}

std::vector<TownOptions> many_towns() {
  std::vector<TownOptions> all;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    for (const auto& [x, y] : {std::pair{1, 1}, {1, 2}, {2, 2}, {3, 3}, {4, 2}})
      all.push_back(test::options_of(seed, x, y));
  }
  for (uint64_t seed = 0; seed < 3; ++seed) {
    for (const TownOptions& options : extremes(seed)) all.push_back(options);
  }
  for (uint64_t seed = 0; seed < 20; ++seed) all.push_back(test::options_of(seed, 3, 3, "city"));
  return all;
}

std::string describe(const TownOptions& options) {
  std::string text = fmt::format("procedural:{}:blocks={}x{}", options.seed, options.blocks_x, options.blocks_y);
  for (const TownFeature& feature : town_features()) {
    text += fmt::format(",{}={}", feature.name, options.*feature.value);
  }
  return text;
}

TEST(ProceduralTownText, FollowsTheRulesOfOpenDrive) {
  for (const TownOptions& options : many_towns()) {
    ASSERT_THAT(violated_rules(OpenDriveText(procedural_town(options))), IsEmpty()) << describe(options);
  }
}

TEST(ProceduralTownLayout, StreetsLeadForwardBetweenTheirCrossings) {
  std::vector<TownOptions> all;
  for (const char* family : {"procedural", "city"}) {
    for (const auto& [x, y] : {std::pair{1, 1}, {1, 4}, {4, 1}, {2, 3}, {4, 3}}) {
      for (uint64_t seed = 0; seed < 40; ++seed) all.push_back(test::mixed_options(seed, x, y, family));
    }
    for (uint64_t seed = 0; seed < 20; ++seed) {
      all.push_back(test::options_of(seed, 4, 3, family));
      all.back().block_m = 80;
      all.back().roundabouts = 1;
      all.back().roundabout_lanes = 2;
    }
  }
  for (const TownOptions& options : all) {
    const town::Layout layout(options);
    for (const town::Street& street : layout.streets()) {
      double turn = 0;
      for (const opendrive::GeometryPiece& piece : street.curve) turn += std::abs(piece.length * piece.start_curvature);
      ASSERT_GE(street.length_m, 3) << describe(options);
      ASSERT_LT(turn, M_PI) << describe(options);
    }
  }
}

double angle_between(double a, double b) { return std::abs(std::remainder(a - b, 2 * M_PI)); }

/// Checks that linked lanes meet: same borders, height, heading and grade.
void check_lane_links(const OpenDriveText& town, const pugi::xml_node& road, bool at_start, int* links) {
  const char* const direction = at_start ? "predecessor" : "successor";
  const pugi::xml_node joint = road.child("link").child(direction);
  ASSERT_TRUE(joint) << "road " << road.attribute("id").value() << " ends in nothing";
  if (is(joint, "elementType", "junction")) return;
  const pugi::xml_node other = town.road(joint.attribute("elementId").value());
  const bool other_start = is(joint, "contactPoint", "start");
  const pugi::xml_node lanes = road.child("lanes");
  const pugi::xml_node section = at_start ? lanes.child("laneSection") : lanes.last_child();
  for (const pugi::xml_node& lane : test::lanes_of(section)) {
    const pugi::xml_node link = lane.child("link").child(direction);
    if (!link) {
      ASSERT_FALSE(is(lane, "type", "driving")) << "road " << road.attribute("id").value();
      continue;
    }
    const LaneEnd here = test::lane_end(road, lane.attribute("id").as_int(), at_start);
    const LaneEnd there = test::lane_end(other, link.attribute("id").as_int(), other_start);
    // +s continues where an end meets a start, and reverses otherwise.
    const bool turns_back = at_start == other_start;
    const std::string at =
        fmt::format("road {} lane {} {}", road.attribute("id").value(), lane.attribute("id").value(), direction);
    ASSERT_LT(std::hypot(here.inner_x - there.inner_x, here.inner_y - there.inner_y), 1e-6) << at;
    ASSERT_LT(std::hypot(here.outer_x - there.outer_x, here.outer_y - there.outer_y), 1e-6) << at;
    ASSERT_LT(angle_between(here.heading, there.heading + (turns_back ? M_PI : 0)), 1e-6) << at;
    ASSERT_NEAR(here.z, there.z, 1e-9) << at;
    ASSERT_NEAR(here.grade, (turns_back ? -1 : 1) * there.grade, 1e-9) << at;
    ++*links;
  }
}

TEST(ProceduralTownText, PiecesAndLanesMeet) {
  int links = 0;
  for (const TownOptions& options : many_towns()) {
    SCOPED_TRACE(describe(options));
    const OpenDriveText town(procedural_town(options));
    for (const pugi::xml_node& road : town.root().children("road")) {
      pugi::xml_node previous;
      for (const pugi::xml_node& geometry : road.child("planView").children("geometry")) {
        ASSERT_GT(geometry.attribute("length").as_double(), 1e-7);
        if (previous) {
          const test::Pose end = test::on_geometry(previous, previous.attribute("length").as_double());
          const test::Pose start = test::on_geometry(geometry, 0);
          ASSERT_LT(std::hypot(end.x - start.x, end.y - start.y), 1e-6) << road.attribute("id").value();
          ASSERT_LT(angle_between(end.heading, start.heading), 1e-6) << road.attribute("id").value();
        }
        previous = geometry;
      }
      for (const bool at_start : {true, false}) {
        check_lane_links(town, road, at_start, &links);
        if (testing::Test::HasFatalFailure()) return;
      }
    }
  }
  EXPECT_GT(links, 50000);
}

/// Checks that a profile is continuous in height and grade, and updates the steepest grade.
void check_grades(const pugi::xml_node& road, double length, double* steepest) {
  double z = 0, grade = 0;
  pugi::xml_node previous;
  for (const pugi::xml_node& piece : road.child("elevationProfile").children("elevation")) {
    const double a = piece.attribute("a").as_double(), b = piece.attribute("b").as_double();
    if (previous) {
      ASSERT_NEAR(z, a, 1e-6);
      ASSERT_NEAR(grade, b, 1e-9);
    }
    const pugi::xml_node next = piece.next_sibling("elevation");
    const double end = next ? next.attribute("s").as_double() : length;
    const double ds = end - piece.attribute("s").as_double(), c = piece.attribute("c").as_double();
    z = a + ds * (b + ds * c);
    grade = b + 2 * c * ds;
    *steepest = std::max({*steepest, std::abs(b), std::abs(grade)});
    previous = piece;
  }
}

TEST(ProceduralTownText, HillsAndRampsAreGentleAndSmooth) {
  double steepest = 0;
  for (uint64_t seed = 0; seed < 30; ++seed) {
    TownOptions options = test::options_of(seed, 4, 4, seed % 3 == 0 ? "city" : "procedural");
    options.hills_m = 50;
    options.overpasses = 1;
    const OpenDriveText town(procedural_town(options));
    for (const pugi::xml_node& road : town.root().children("road")) {
      check_grades(road, road.attribute("length").as_double(), &steepest);
      if (HasFatalFailure()) return;
    }
  }
  EXPECT_LT(steepest, 0.08);
  EXPECT_GT(steepest, 0.07);
}

TEST(ProceduralTownText, EqualOptionsGiveEqualBytesAndOthersDiffer) {
  std::set<std::string> texts;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const std::string text = procedural_town(test::options_of(seed, 3, 2));
    EXPECT_EQ(text, procedural_town(test::options_of(seed, 3, 2)));
    texts.insert(text);
  }
  EXPECT_EQ(texts.size(), 20u);
  EXPECT_NE(procedural_town(test::options_of(uint64_t{1} << 40, 2, 2)), procedural_town(test::options_of(0, 2, 2)));
}

// ---- effects of the options

/// Amounts of each feature in a town.
struct Counts {
  double streets_m = 0;
  int arcs = 0, five_arms = 0, roundabouts = 0, max_lanes = 0, slips = 0, heights = 0, crosswalks = 0, sidewalks = 0,
      parking = 0, lights = 0, crossings = 0, wide_roundabouts = 0, ramps = 0, motorways = 0;
};

Counts count(const TownOptions& options) {
  const OpenDriveText town(procedural_town(options));
  Counts counts;
  counts.lights = town.count("//signal");
  counts.crosswalks = town.count("//object[@type='crosswalk']");
  counts.sidewalks = town.count("//lane[@type='sidewalk']");
  counts.parking = town.count("//lane[@type='parking']");
  counts.slips = town.count("//lane[@type='exit']");
  counts.arcs = town.count("//road[@junction='-1']//arc");
  // Outside junctions only ramps and the circles of roundabouts are one-way.
  const std::string one_way = "//road[@junction='-1'][not(.//left)]", slow = "[type/speed/@max < 8]";
  counts.roundabouts = town.count((one_way + slow).c_str());
  counts.wide_roundabouts = town.count((one_way + slow + "[.//right/lane[@id='-2'][@type='driving']]").c_str());
  counts.ramps = town.count(one_way.c_str()) - counts.roundabouts;
  counts.motorways = town.count("//road[@junction='-1'][type/speed/@max > 24]");
  for (int lanes = 1; lanes <= 3; ++lanes) {
    if (town.count(fmt::format("//road[@junction='-1']//right/lane[@id='{}'][@type='driving']", -lanes).c_str()) > 0) {
      counts.max_lanes = lanes;
    }
  }
  std::set<double> heights;
  for (const pugi::xml_node& road : town.root().children("road")) {
    heights.insert(road.child("elevationProfile").child("elevation").attribute("a").as_double());
    if (is(road, "junction", "-1")) counts.streets_m += road.attribute("length").as_double();
  }
  counts.heights = static_cast<int>(heights.size());
  for (const pugi::xml_node& junction : town.root().children("junction")) {
    std::set<std::string> arms;
    for (const pugi::xml_node& connection : junction.children("connection")) {
      arms.insert(connection.attribute("incomingRoad").value());
    }
    counts.five_arms += arms.size() == 5 ? 1 : 0;
    counts.crossings += arms.size() > 2 ? 1 : 0;
  }
  return counts;
}

Counts count_with(double TownOptions::* feature, double value) {
  TownOptions options = test::options_of(5, 5, 5);
  options.*feature = value;
  return count(options);
}

TEST(ProceduralTownOptions, NoFeatureAtZero) {
  EXPECT_EQ(count_with(&TownOptions::five_arms, 0).five_arms, 0);
  EXPECT_EQ(count_with(&TownOptions::roundabouts, 0).roundabouts, 0);
  EXPECT_EQ(count_with(&TownOptions::slip_lanes, 0).slips, 0);
  EXPECT_EQ(count_with(&TownOptions::crosswalks, 0).crosswalks, 0);
  EXPECT_EQ(count_with(&TownOptions::sidewalks, 0).sidewalks, 0);
  EXPECT_EQ(count_with(&TownOptions::parking, 0).parking, 0);
  EXPECT_EQ(count_with(&TownOptions::lights, 0).lights, 0);
  EXPECT_EQ(count_with(&TownOptions::max_lanes, 1).max_lanes, 1);
  EXPECT_EQ(count_with(&TownOptions::max_lanes, 2).max_lanes, 2);
  TownOptions options = test::options_of(5, 5, 5);
  options.avenues = options.ring_road = 0;
  EXPECT_EQ(count(options).max_lanes, 1);
  options.hills_m = options.overpasses = 0;
  EXPECT_EQ(count(options).heights, 1);
}

TEST(ProceduralTownOptions, AtLeastOneOfAFeatureAboveZero) {
  constexpr double kTiny = 1e-6;
  EXPECT_GE(count_with(&TownOptions::five_arms, kTiny).five_arms, 1);
  EXPECT_EQ(count_with(&TownOptions::roundabouts, kTiny).roundabouts, 4);
  EXPECT_EQ(count_with(&TownOptions::slip_lanes, kTiny).slips, 1);
  EXPECT_EQ(count_with(&TownOptions::parking, kTiny).parking, 1);
  EXPECT_GT(count_with(&TownOptions::lights, kTiny).lights, 2);
  EXPECT_LT(count_with(&TownOptions::lights, kTiny).lights, 6);
}

TEST(ProceduralTownOptions, MoreOfAFeatureWithALargerValue) {
  const Counts usual = count(test::options_of(5, 5, 5));
  EXPECT_GT(count_with(&TownOptions::five_arms, 1).five_arms, usual.five_arms);
  EXPECT_GT(count_with(&TownOptions::roundabouts, 1).roundabouts, usual.roundabouts);
  EXPECT_GT(count_with(&TownOptions::slip_lanes, 1).slips, usual.slips);
  EXPECT_GT(count_with(&TownOptions::crosswalks, 1).crosswalks, usual.crosswalks);
  EXPECT_GT(count_with(&TownOptions::sidewalks, 1).sidewalks, usual.sidewalks);
  EXPECT_GT(count_with(&TownOptions::parking, 1).parking, usual.parking);
  EXPECT_GT(count_with(&TownOptions::lights, 1).lights, usual.lights);
  EXPECT_GT(count_with(&TownOptions::curved, 1).arcs, count_with(&TownOptions::curved, 0).arcs);
  EXPECT_GT(count_with(&TownOptions::density, 1).streets_m, usual.streets_m);
  EXPECT_LT(count_with(&TownOptions::density, 0).streets_m, usual.streets_m);
  EXPECT_EQ(usual.max_lanes, 3);
}

TEST(ProceduralTownOptions, RoundaboutsAndLightsEverywhere) {
  TownOptions options = test::options_of(3, 4, 4);
  options.density = 1;
  options.avenues = options.ring_road = options.five_arms = options.overpasses = 0;
  options.roundabouts = 1;
  const Counts roundabouts = count(options);
  EXPECT_EQ(roundabouts.crossings, 0);  // 21 nodes have three or four arms, together 9 * 4 + 12 * 3
  EXPECT_EQ(roundabouts.roundabouts, 72);
  EXPECT_EQ(roundabouts.lights, 0);
  options.roundabouts = 0;
  options.lights = 1;
  EXPECT_EQ(count(options).lights, 72);
}

TEST(ProceduralTownOptions, TheDefaultTownHasEverything) {
  for (uint64_t seed = 0; seed < 10; ++seed) {
    const Counts counts = count(test::options_of(seed, 3, 3));
    for (const int feature : {counts.roundabouts, counts.slips, counts.heights - 1, counts.crosswalks, counts.sidewalks,
                              counts.parking, counts.lights, counts.max_lanes - 1, counts.arcs, counts.five_arms}) {
      EXPECT_GT(feature, 0) << "seed " << seed;
    }
  }
}

TEST(ProceduralTownOptions, ACityHasEverything) {
  int wide_roundabouts = 0;
  for (uint64_t seed = 0; seed < 20; ++seed) {
    const Counts counts = count(test::options_of(seed, 3, 3, "city"));
    for (const int feature : {counts.roundabouts, counts.slips, counts.heights - 1, counts.crosswalks, counts.sidewalks,
                              counts.parking, counts.lights, counts.max_lanes - 1, counts.arcs}) {
      EXPECT_GT(feature, 0) << "seed " << seed;
    }
    EXPECT_EQ(counts.ramps, 8) << "seed " << seed;
    EXPECT_GE(counts.motorways, 10) << "seed " << seed;
    wide_roundabouts += counts.wide_roundabouts > 0 ? 1 : 0;
  }
  EXPECT_GT(wide_roundabouts, 10);
}

TEST(ProceduralTownOptions, AMotorwayNeedsACrossingBetweenCorners) {
  EXPECT_EQ(count(test::options_of(0, 1, 1, "city")).ramps, 0);
  EXPECT_EQ(count(test::options_of(0, 1, 2, "city")).ramps, 8);
  EXPECT_EQ(count(test::options_of(0, 2, 1, "city")).ramps, 8);
}

TEST(ProceduralTownOptions, RejectsValuesOutOfRange) {
  const auto message_of = [](const TownOptions& options) -> std::string {
    return test::message_of<UsageError>([&] { procedural_town(options); });
  };
  for (const auto& [x, y] : {std::pair{0, 3}, {3, 0}, {33, 1}, {1, 33}, {-1, 2}}) {
    EXPECT_THAT(message_of(test::options_of(0, x, y)),
                HasSubstr(fmt::format("blocks: expected 1 to 32 each way, got {} x {}", x, y)));
  }
  for (const TownFeature& feature : town_features()) {
    for (const double value : {feature.low - 0.1, feature.high + 0.1, std::nan("")}) {
      TownOptions options;
      options.*feature.value = value;
      EXPECT_THAT(message_of(options), HasSubstr(fmt::format("{}: expected {} to {}, got {}", feature.name, feature.low,
                                                             feature.high, value)));
    }
  }
  EXPECT_NO_THROW(procedural_town(test::options_of(0, 32, 1)));
  TownOptions options;
  options.max_lanes = 1.5;
  EXPECT_THAT(message_of(options), HasSubstr("max-lanes: expected a whole number, got 1.5"));
  options.max_lanes = 2;
  options.roundabout_lanes = 1.5;
  EXPECT_THAT(message_of(options), HasSubstr("roundabout-lanes: expected a whole number, got 1.5"));
}

TEST(ProceduralTownOptions, AreReadFromMapNames) {
  const auto parsed = [](const std::string& name) { return parse_town_name(name).value(); };
  const TownOptions options = parsed("procedural:7:blocks=4x2,roundabouts=0.5,hills-m=0");
  EXPECT_EQ(options.seed, 7u);
  EXPECT_EQ(options.blocks_x, 4);
  EXPECT_EQ(options.blocks_y, 2);
  EXPECT_EQ(options.roundabouts, 0.5);
  EXPECT_EQ(options.hills_m, 0);
  EXPECT_EQ(options.parking, TownOptions().parking);
  EXPECT_EQ(parsed("procedural:010").seed, 10u);
  EXPECT_EQ(parsed("procedural:1e3:blocks=1e1x2").seed, 1000u);
  EXPECT_EQ(parsed("city").seed, 0u);
  EXPECT_EQ(parsed("city:3:parking=0").motorway, 1);
  EXPECT_EQ(parsed("city:3:parking=0").parking, 0);
  for (const char* name : {"", "Town01", "citys:1", "cit", "procedural2", "city.xodr"}) {
    EXPECT_FALSE(parse_town_name(name)) << name;
  }
  EXPECT_THAT(test::message_of<UsageError>([&] { parsed("city:x"); }), HasSubstr("expected city or city:SEED"));
  const auto message_of = [](const char* text) -> std::string {
    return test::message_of<UsageError>([&] { parse_town_name(std::string("procedural:") + text); });
  };
  for (const char* text : {"", "x", "-1", "1x", "18446744073709551616"}) {
    EXPECT_THAT(message_of(text), HasSubstr("expected procedural or procedural:SEED")) << text;
  }
  EXPECT_THAT(message_of("1:"), HasSubstr("expected NAME=VALUE, got ''"));
  EXPECT_THAT(message_of("1:hills-m=2,"), HasSubstr("expected NAME=VALUE, got ''"));
  EXPECT_THAT(message_of("1:rivers=2"), HasSubstr("unknown option 'rivers'; expected one of blocks, block-m, density"));
  EXPECT_THAT(message_of("1:parkin=1"), HasSubstr("did you mean 'parking'?"));
  EXPECT_THAT(message_of("1:parking=1,parking=0"), HasSubstr("parking: given twice"));
  EXPECT_THAT(message_of("1:hills-m=2m"), HasSubstr("hills-m: expected a number of 0 to 50, got '2m'"));
  EXPECT_THAT(message_of("1:blocks=4"),
              HasSubstr("blocks: expected AxB, for instance 4x3, with 1 to 32 each, got '4'"));
  EXPECT_THAT(message_of("1:blocks=4x3x2"), HasSubstr("blocks: expected AxB"));
  EXPECT_THAT(message_of("1:roundabouts=2"), HasSubstr("roundabouts: expected 0 to 1, got 2"));
}

}  // namespace
}  // namespace pictura
