// Export of maps: importing an exported file gives the same map, and exporting that map gives the same text.
#include <filesystem>
#include <string>

#include <gmock/gmock.h>
#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/map/load_map.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/opendrive/writer.h"
#include "pictura/map/procedural/procedural_town.h"

namespace pictura {
namespace {

using testing::HasSubstr;
using testing::Not;

/// Exports twice: the second export changes no byte, and its map equals the original's.
void check_round_trip(const std::string& text, const std::string& name) {
  const std::string once = export_opendrive(text, name);
  ASSERT_EQ(export_opendrive(once, name), once);
  RoadMap original = parse_opendrive(text, name), exported = parse_opendrive(once, name);
  // Line numbers differ in the export, which also lacks sections shorter than a millimetre, because the reader removes
  // them.
  for (RoadMap* map : {&original, &exported}) {
    map->provenance = {};
    std::erase_if(map->mends, [](const Repair& repair) { return repair.kind == RepairKind::short_section; });
    for (Repair& repair : map->mends) repair.line = 0;
    for (Lane& lane : map->lanes) lane.source_section = 0;
  }
  EXPECT_EQ(first_difference(original, exported), "");
}

/// Contains every kind of element that a Network stores.
constexpr const char* kEverything = R"(<?xml version="1.0"?>
<OpenDRIVE>
<header revMajor="1" revMinor="8">
 <geoReference><![CDATA[+proj=tmerc +lat_0=1 <b>]]></geoReference><offset x="3" y="4" z="0.5" hdg="0.1"/>
</header>
<road id="1" length="100" junction="-1" name="banked">
 <link><successor elementType="junction" elementId="9"/></link>
 <type s="0" type="town"><speed max="50" unit="km/h"/></type><type s="40" type="town"/>
 <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
 <elevationProfile><elevation s="0" a="1" b="0.01" c="0" d="0"/></elevationProfile>
 <lateralProfile>
  <superelevation s="0" a="0.02" b="0" c="0" d="0"/>
  <crossfall side="left" s="0" a="0.01" b="0" c="0" d="0"/><crossfall side="both" s="50" a="0.03" b="0" c="0" d="0"/>
  <shape s="0" t="-20" a="0.1" b="0.001" c="0" d="0"/><shape s="0" t="0" a="0" b="0.002" c="0" d="0"/>
  <shape s="100" t="-20" a="0" b="0" c="0" d="0"/>
 </lateralProfile>
 <lanes><laneOffset s="0" a="0.3" b="0" c="0" d="0"/>
  <laneSection s="0">
   <left><lane id="1" type="driving" direction="both" level="true"><border sOffset="0" a="4" b="0" c="0" d="0"/></lane></left>
   <center><lane id="0" type="none"><roadMark sOffset="0" type="solid broken" weight="bold" color="yellow" width="0.2"
    laneChange="increase"><sway ds="0" a="0.1" b="0" c="0" d="0"/></roadMark></lane></center>
   <right><lane id="-1" type="driving"><link><successor id="-1"/><successor id="-2"/></link>
    <width sOffset="0" a="3.5" b="0" c="0" d="0"/>
    <roadMark sOffset="0" type="custom" color="blue" laneChange="none"><type name="x" width="0.1">
     <line length="2" space="3" tOffset="0.1" sOffset="1" width="0.2" color="red"/></type></roadMark>
    <roadMark sOffset="30" type="broken" color="white"><explicit><line length="4" tOffset="0" sOffset="2"/></explicit></roadMark>
    <speed sOffset="0" max="30" unit="mph"/><speed sOffset="20" max="no limit"/>
    <height sOffset="0" inner="0.1" outer="0.2"/></lane></right>
  </laneSection>
  <laneSection s="60" singleSide="true"><center><lane id="0" type="none"/></center>
   <right><lane id="-1" type="driving"><link><predecessor id="-1"/></link><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
    <lane id="-2" type="exit"><link><predecessor id="-1"/></link><width sOffset="0" a="0" b="0.1" c="0" d="0"/></lane></right>
  </laneSection></lanes>
 <objects>
  <object id="7" type="parkingSpace" s="5" t="-6" length="5" width="2" zOffset="0.1" hdg="0.2">
   <repeat s="5" length="20" distance="10" tStart="-6" tEnd="-7"/></object>
  <object type="crosswalk" s="50" t="0"><outline><cornerRoad s="50" t="-3" dz="0" height="0"/>
   <cornerRoad s="53" t="-3" dz="0" height="0"/><cornerRoad s="53" t="3" dz="0.1" height="0"/></outline></object>
  <object id="8" name="StopLine" type="none" s="90" t="-2" length="0.4" width="3" zOffset="0"/>
 </objects>
 <signals>
  <signal id="20" name="limit" s="30" t="-5" zOffset="2" type="274" subtype="50" country="DE" dynamic="no" orientation="+"
   hOffset="0.1"><validity fromLane="-1" toLane="-1"/></signal>
  <signal id="21" s="95" t="-5" zOffset="0" type="1000001" subtype="-1" dynamic="yes" orientation="-"/>
 </signals>
</road>
<road id="2" length="50" junction="-1"><link><predecessor elementType="junction" elementId="9"/></link>
 <planView><geometry s="0" x="100" y="0" hdg="0" length="50"><spiral curvStart="0" curvEnd="0.02"/></geometry></planView>
 <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes>
 <signals><signalReference s="1" t="0" id="20" orientation="none"><validity fromLane="-1" toLane="-1"/></signalReference></signals>
</road>
<road id="3" length="40" junction="-1" rule="LHT">
 <planView><geometry s="0" x="0" y="80" hdg="0" length="40"><poly3 a="0" b="0" c="0.01" d="0"/></geometry></planView>
 <lanes><laneSection s="0"><left><lane id="1" type="bus"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left>
  <center><lane id="0" type="none"/></center></laneSection></lanes></road>
<road id="4" length="40" junction="-1">
 <planView><geometry s="0" x="0" y="160" hdg="0" length="40"><paramPoly3 aU="0" bU="40" cU="0" dU="0" aV="0" bV="0" cV="0.5"
  dV="0" pRange="normalized"/></geometry></planView>
 <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>
<road id="5" length="40" junction="-1">
 <planView><geometry s="0" x="0" y="240" hdg="0" length="40"><paramPoly3 aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="0.0001"
  dV="0" pRange="arcLength"/></geometry></planView>
 <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes></road>
<junction id="9" name="" type="direct"><connection id="0" incomingRoad="1" linkedRoad="2" contactPoint="start">
 <laneLink from="-1" to="-1"/></connection><controller id="30"/></junction>
<controller id="30" sequence="2"><control signalId="21"/></controller>
</OpenDRIVE>
)";

TEST(OpenDriveExport, KeepsEverythingInANetwork) {
  check_round_trip(kEverything, "everything");
  const std::string text = export_opendrive(kEverything, "everything");
  for (const char* expected : {"revMinor=\"8\"",
                               "<![CDATA[+proj=tmerc +lat_0=1 <b>]]>",
                               "rule=\"LHT\"",
                               "<poly3",
                               "pRange=\"normalized\"",
                               "pRange=\"arcLength\"",
                               "<spiral",
                               "<superelevation",
                               "crossfall side=\"left\"",
                               "crossfall side=\"right\"",
                               "<shape",
                               "direction=\"both\"",
                               "level=\"true\"",
                               "<border",
                               "singleSide=\"true\"",
                               "<sway",
                               "weight=\"bold\"",
                               "laneChange=\"increase\"",
                               "<explicit>",
                               "color=\"red\"",
                               "max=\"no limit\"",
                               "inner=\"0.1\" outer=\"0.2\"",
                               "type=\"bus\"",
                               "id=\"7\"",
                               "id=\"7-1\"",
                               "cornerRoad",
                               "subtype=\"signalLines\"",
                               "country=\"DE\"",
                               "orientation=\"+\"",
                               "hOffset=\"0.1\"",
                               "type=\"direct\"",
                               "linkedRoad=\"2\"",
                               "sequence=\"2\""}) {
    EXPECT_THAT(text, HasSubstr(expected));
  }
  EXPECT_THAT(text, Not(HasSubstr("<offset")));  // the reader has applied the offset
}

class CarlaExport : public testing::TestWithParam<const char*> {};
INSTANTIATE_TEST_SUITE_P(Towns, CarlaExport,
                         testing::Values("Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07",
                                         "Town10HD"));

TEST_P(CarlaExport, KeepsTheMapAndReexportsEqualBytes) {
  const std::string path = map_folder() + "/carla/" + GetParam() + ".xodr";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << path << " is not there";
  check_round_trip(read_file(path), path);
}

TEST(OpenDriveExport, KeepsEveryByteOfProceduralTowns) {
  for (uint64_t seed = 0; seed < 20; ++seed) {
    for (const TownFamily& family : town_families()) {
      TownOptions options = family.defaults;
      options.seed = seed;
      const std::string text = procedural_town(options);
      ASSERT_EQ(export_opendrive(text, "town"), text) << family.name << " seed " << seed;
    }
  }
}

}  // namespace
}  // namespace pictura
