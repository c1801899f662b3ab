// The effect of each element of OpenDRIVE 1.4 to 1.8 in the importer, and the table of these effects in
// docs/reference/opendrive_conformance.md. The tests read a file with the element and a file without it. The versions
// of an element are those of the standard's schemas.
#include <optional>
#include <set>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/map/map_cache.h"
#include "pictura/map/opendrive/opendrive.h"
#include "pictura/map/repairs.h"
#include "pictura/tests/map/small_roads.h"

namespace pictura {
namespace {

using test::replaced;

struct Element {
  std::string path;  // below <OpenDRIVE>
  std::string versions;
  std::string with, without;  // files
};

const std::string kAll = "1.4-1.8";

// The file into which elements are inserted, at marks @NAME@. Road 1 leads through junction 7, on road 2, to road 3;
// road 9 lies apart. Inserted text has no line breaks, so that the lines of all other elements stay the same.
const std::string kFile = R"(<?xml version="1.0"?>
<OpenDRIVE>
<header revMajor="1" revMinor="8">@header@</header>@root@
<road id="1" length="100" junction="-1">
 <link><successor elementType="junction" elementId="7"/>@link@</link>@type@
 <planView><geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry></planView>
 <lanes><laneSection s="0">@section@<center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/>@lane@</lane>
  <lane id="-2" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>@right@
 </right></laneSection></lanes>
 <objects>@objects@
  <object id="1" type="parkingSpace" s="50" t="-9" zOffset="0" hdg="0" length="5" width="2.5">@space@</object>
  <object id="2" type="crosswalk" s="80" t="0" zOffset="0" hdg="0" length="4" width="8">@crosswalk@</object>
 </objects>
 <signals>@signals@
  <signal id="5" type="1000001" s="95" t="-8" zOffset="3" orientation="+" dynamic="yes">@light@</signal>
  <signal id="6" type="206" s="60" t="-8" zOffset="3" orientation="+" dynamic="no">@sign@</signal>
 </signals>@road@
</road>
<road id="2" length="20" junction="7">
 <link><predecessor elementType="road" elementId="1" contactPoint="end"/>
  <successor elementType="road" elementId="3" contactPoint="start"/></link>
 <planView><geometry s="0" x="100" y="0" hdg="0" length="20"><line/></geometry></planView>
 <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><link><successor id="-1"/></link><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
 </right></laneSection></lanes>
</road>
<road id="3" length="100" junction="-1">
 <link><predecessor elementType="junction" elementId="7"/></link>
 <planView><geometry s="0" x="120" y="0" hdg="0" length="100"><line/></geometry></planView>
 <lanes><laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
 </right></laneSection></lanes>
</road>
<road id="9" length="50" junction="-1">
 <planView><geometry s="0" x="0" y="200" hdg="0" length="50"><line/></geometry></planView>
 <elevationProfile>@elevation@</elevationProfile><lateralProfile>@lateral@</lateralProfile>
 <lanes>@offset@<laneSection s="0"><center><lane id="0" type="none"/></center><right>
  <lane id="-1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane>
 </right></laneSection></lanes>
</road>
<controller id="1"><control signalId="5" type=""/></controller>
<junction id="7" name="">
 <connection id="0" incomingRoad="1" connectingRoad="2" contactPoint="start"><laneLink from="-1" to="-1"/>@connection@</connection>
 <controller id="1"/>@junction@
</junction>
</OpenDRIVE>
)";

/// Returns a file with `text` at one mark and nothing at the others.
std::string filled(std::string file, const std::string& mark = "", const std::string& text = "") {
  for (size_t begin = 0; (begin = file.find('@')) != std::string::npos;) {
    const size_t end = file.find('@', begin + 1);
    file.replace(begin, end + 1 - begin, file.substr(begin + 1, end - begin - 1) == mark ? text : "");
  }
  return file;
}

/// An element inserted at a mark, within `around` at its @.
Element put(const std::string& path, const std::string& versions, const std::string& mark, const std::string& text,
            const std::string& around = "@") {
  return {path, versions, filled(kFile, mark, replaced(around, "@", text)),
          filled(kFile, mark, replaced(around, "@", ""))};
}

/// The part of the file from `begin` to `end`, compared with the file without it.
Element had(const std::string& path, const std::string& begin, const std::string& end = "") {
  const size_t from = kFile.find(begin), to = end.empty() ? from + begin.size() : kFile.find(end, from) + end.size();
  return {path, kAll, filled(kFile), filled(kFile.substr(0, from) + kFile.substr(to))};
}

/// A curve in place of road 9's straight line, or in place of another curve.
Element drawn(const std::string& path, const std::string& curve, const std::string& instead = "<line/>") {
  const auto with = [](const std::string& element) {
    const std::string before = R"(y="200" hdg="0" length="50">)";
    return filled(replaced(kFile, before + "<line/>", before + element));
  };
  return {path, kAll, with(curve), with(instead)};
}

std::vector<Element> elements() {
  const std::string outline =
      R"(<outline><cornerLocal u="-2" v="-1" z="0"/><cornerLocal u="2" v="-1" z="0"/><cornerLocal u="2" v="1" z="0"/>)"
      R"(<cornerLocal u="-2" v="1" z="0"/></outline>)";
  const std::string mark =
      R"(<roadMark sOffset="0" type="solid" weight="standard" color="white" width="0.12">@</roadMark>)";
  return {
      had("header", "<header", "</header>"),
      put("header/geoReference", kAll, "header", "<geoReference>+proj=utm +zone=32</geoReference>"),
      put("header/offset", "1.5-1.8", "header", R"(<offset x="5" y="6" z="0" hdg="0"/>)"),
      put("header/license", "1.8", "header", R"(<license name="MIT"/>)"),
      put("header/defaultRegulations", "1.8", "header", "<defaultRegulations/>"),
      put("userData, anywhere", kAll, "lane", R"(<userData code="a" value="b"/>)"),
      put("dataQuality, anywhere", "1.5-1.8", "lane",
          R"(<dataQuality><error xyAbsolute="1" zAbsolute="1" xyRelative="1" zRelative="1"/></dataQuality>)"),
      put("include, anywhere", kAll, "lane", R"(<include file="other.xodr"/>)"),
      had("road/link/predecessor, successor", R"(<successor elementType="road" elementId="3" contactPoint="start"/>)"),
      put("road/link/neighbor", "1.4-1.5", "link", R"(<neighbor side="left" elementId="3" direction="same"/>)"),
      put("road/type", kAll, "type", R"(<type s="0" type="town"/>)"),
      put("road/type/speed", kAll, "type", R"(<speed max="36" unit="km/h"/>)", R"(<type s="0" type="town">@</type>)"),
      had("planView", "<planView>", "</planView>"),
      had("planView/geometry", "<geometry", "</geometry>"),
      drawn("geometry/line", "<line/>", R"(<arc curvature="0.01"/>)"),
      drawn("geometry/arc", R"(<arc curvature="0.01"/>)"),
      drawn("geometry/spiral", R"(<spiral curvStart="0" curvEnd="0.02"/>)"),
      drawn("geometry/poly3", R"(<poly3 a="0" b="0" c="0.001" d="0"/>)"),
      drawn("geometry/paramPoly3",
            R"(<paramPoly3 pRange="arcLength" aU="0" bU="1" cU="0" dU="0" aV="0" bV="0" cV="1e-4" dV="0"/>)"),
      put("elevationProfile/elevation", kAll, "elevation", R"(<elevation s="0" a="1" b="0.01" c="0" d="0"/>)"),
      put("lateralProfile/superelevation", kAll, "lateral", R"(<superelevation s="0" a="0.05" b="0" c="0" d="0"/>)"),
      put("lateralProfile/crossfall", "1.4-1.5", "lateral",
          R"(<crossfall side="both" s="0" a="0.05" b="0" c="0" d="0"/>)"),
      put("lateralProfile/shape", kAll, "lateral",
          R"(<shape s="0" t="-6" a="0.2" b="0" c="0" d="0"/><shape s="0" t="0" a="0" b="0" c="0" d="0"/>)"),
      put("lateralProfile/crossSectionSurface", "1.8", "lateral",
          R"(<crossSectionSurface><surfaceStrips><strip id="-1"><constant><coefficients s="0" a="0.1" b="0" c="0" )"
          R"(d="0"/></constant></strip></surfaceStrips></crossSectionSurface>)"),
      put("lanes/laneOffset", kAll, "offset", R"(<laneOffset s="0" a="1" b="0" c="0" d="0"/>)"),
      had("lanes/laneSection", "<laneSection", "</laneSection>"),
      put("laneSection/left, center, right", kAll, "section",
          R"(<left><lane id="1" type="driving"><width sOffset="0" a="3" b="0" c="0" d="0"/></lane></left>)"),
      had("lane/link/predecessor, successor", R"(<link><successor id="-1"/></link>)"),
      had("lane/width", R"(<width sOffset="0" a="3" b="0" c="0" d="0"/>)"),
      put("lane/border", kAll, "right", R"(<border sOffset="0" a="-8" b="0" c="0" d="0"/>)",
          R"(<lane id="-3" type="shoulder">@</lane>)"),
      put("lane/height", kAll, "lane", R"(<height sOffset="0" inner="0.1" outer="0.1"/>)"),
      put("lane/speed", kAll, "lane", R"(<speed sOffset="0" max="10" unit="m/s"/>)"),
      put("lane/access", kAll, "lane", R"(<access sOffset="0" rule="deny" restriction="truck"/>)"),
      put("lane/material", kAll, "lane", R"(<material sOffset="0" surface="asphalt" friction="0.8" roughness="0.1"/>)"),
      put("lane/rule", kAll, "lane", R"(<rule sOffset="0" value="no stopping"/>)"),
      put("lane/visibility", "1.4-1.5", "lane",
          R"(<visibility sOffset="0" forward="100" back="100" left="10" right="10"/>)"),
      put("lane/roadMark", kAll, "lane", replaced(mark, "@", "")),
      put("roadMark/type, type/line", kAll, "lane",
          R"(<type name="dashed" width="0.12"><line length="3" space="3" tOffset="0" sOffset="0" width="0.12"/></type>)",
          mark),
      put("roadMark/explicit, explicit/line", "1.5-1.8", "lane",
          R"(<explicit><line length="20" tOffset="0" sOffset="0" width="0.12"/></explicit>)", mark),
      put("roadMark/sway", "1.5-1.8", "lane", R"(<sway ds="0" a="0.1" b="0" c="0" d="0"/>)", mark),
      had("objects/object, crosswalks", R"(<object id="2")", "</object>"),
      had("objects/object, parking spaces", R"(<object id="1")", "</object>"),
      put("objects/object, stop lines", kAll, "objects",
          R"(<object id="3" type="roadMark" subtype="signalLines" s="90" t="-3" zOffset="0" hdg="0" length="0.4" )"
          R"(width="6"/>)"),
      put("objects/object, others", kAll, "objects",
          R"(<object id="3" type="tree" s="50" t="12" zOffset="0" hdg="0" radius="1" height="8"/>)"),
      put("object/outline, cornerLocal", kAll, "crosswalk", outline),
      put("object/outlines", "1.5-1.8", "crosswalk",
          "<outlines>" + replaced(outline, "<outline>", R"(<outline id="0" outer="true">)") + "</outlines>"),
      put("outline/cornerRoad", kAll, "crosswalk",
          R"(<outline><cornerRoad s="78" t="-6" dz="0" height="0"/><cornerRoad s="82" t="-6" dz="0" height="0"/>)"
          R"(<cornerRoad s="82" t="0" dz="0" height="0"/></outline>)"),
      put("object/repeat", kAll, "space",
          R"(<repeat s="50" length="20" distance="6" tStart="-9" tEnd="-9" zOffsetStart="0" zOffsetEnd="0"/>)"),
      put("object/parkingSpace", kAll, "space", R"(<parkingSpace access="all"/>)"),
      put("parkingSpace/marking", "1.4", "space", R"(<marking side="left" type="solid" width="0.1" color="white"/>)",
          R"(<parkingSpace access="all">@</parkingSpace>)"),
      put("object/markings", "1.5-1.8", "space",
          R"(<markings><marking side="left" color="white" width="0.1" spaceLength="0" lineLength="1" startOffset="0" )"
          R"(stopOffset="0"/></markings>)"),
      put("object/borders", "1.5-1.8", "space",
          R"(<borders><border width="0.1" type="curb" outlineId="0" useCompleteOutline="true"/></borders>)"),
      put("object/material", kAll, "space", R"(<material surface="asphalt"/>)"),
      put("object/validity", kAll, "crosswalk", R"(<validity fromLane="-1" toLane="-1"/>)"),
      put("object/surface", "1.7-1.8", "space", R"(<surface><CRG file="a.crg"/></surface>)"),
      put("object/skeleton", "1.8", "space",
          R"(<skeleton><polyline><vertexLocal u="0" v="0" z="0"/><vertexLocal u="1" v="0" z="0"/></polyline></skeleton>)"),
      put("objects/objectReference", kAll, "objects", R"(<objectReference id="1" s="50" t="0"/>)"),
      put("objects/tunnel", kAll, "objects", R"(<tunnel id="4" s="10" length="20" type="standard"/>)"),
      put("objects/bridge", kAll, "objects", R"(<bridge id="4" s="10" length="20" type="concrete"/>)"),
      had("signals/signal, lights", R"(<signal id="5")", "</signal>"),
      had("signals/signal, signs", R"(<signal id="6")", "</signal>"),
      put("signal/validity", kAll, "sign", R"(<validity fromLane="-1" toLane="-1"/>)"),
      put("signal/dependency", kAll, "light", R"(<dependency id="6" type=""/>)"),
      put("signal/reference", "1.5-1.8", "light", R"(<reference elementType="signal" elementId="6"/>)"),
      put("signal/positionRoad", "1.5-1.8", "light",
          R"(<positionRoad roadId="2" s="0" t="-8" zOffset="3" hOffset="0"/>)"),
      put("signal/positionInertial", "1.5-1.8", "light", R"(<positionInertial x="100" y="-8" z="3" hdg="0"/>)"),
      put("signal/semantics", "1.8", "sign", R"(<semantics><priority type="stop"/></semantics>)"),
      put("signal/staticBoard", "1.8", "sign", R"(<staticBoard><sign type="206" v="0" z="0"/></staticBoard>)"),
      put("signal/vmsBoard", "1.8", "sign", R"(<vmsBoard displayType="other"/>)"),
      put("signals/signalReference", kAll, "signals",
          R"(<signalReference id="6" s="80" t="-8" orientation="+"><validity fromLane="-1" toLane="-1"/></signalReference>)"),
      put("road/surface", kAll, "road",
          R"(<surface><CRG file="a.crg" sStart="0" sEnd="10" orientation="same" mode="attached"/></surface>)"),
      put("road/railroad", kAll, "road",
          R"(<railroad><switch name="a" id="1" position="dynamic"><mainTrack id="1" s="1" dir="+"/></switch></railroad>)"),
      had("controller", R"(<controller id="1"><control signalId="5" type=""/></controller>)"),
      had("controller/control", R"(<control signalId="5" type=""/>)"),
      had("junction", "<junction id", "</junction>"),
      had("junction/connection", "<connection", "</connection>"),
      had("connection/laneLink", R"(<laneLink from="-1" to="-1"/>)"),
      put("connection/predecessor, successor", "1.5-1.8", "connection",
          R"(<predecessor elementType="road" elementId="1" elementS="50" elementDir="+"/>)"),
      put("junction/priority", kAll, "junction", R"(<priority high="1" low="3"/>)"),
      had("junction/controller", R"(<controller id="1"/>)"),
      put("junction/surface", "1.5-1.7", "junction", R"(<surface><CRG file="a.crg" mode="attached"/></surface>)"),
      put("junction/boundary", "1.8", "junction",
          R"(<boundary><segment type="lane" roadId="2" boundaryLane="-1" sStart="0" sEnd="20"/></boundary>)"),
      put("junction/elevationGrid", "1.8", "junction",
          R"(<elevationGrid gridSpacing="5"><elevation center="1"/></elevationGrid>)"),
      put("junction, type crossing", "1.8", "root",
          R"(<junction id="8" type="crossing"><crossPath id="0" crossingRoad="1" roadAtStart="2" roadAtEnd="3"/></junction>)"),
      put("junction, type virtual", "1.7-1.8", "root",
          R"(<junction id="8" type="virtual" mainRoad="1" sStart="10" sEnd="20" orientation="+"/>)"),
      put("junctionGroup", kAll, "root",
          R"(<junctionGroup id="1" type="roundabout"><junctionReference junction="7"/></junctionGroup>)"),
      put("station", kAll, "root",
          R"(<station id="1" name="a"><platform id="1"><segment roadId="1" sStart="0" sEnd="9" side="right"/></platform></station>)"),
      put("vmsGroup", "1.8", "root", R"(<vmsGroup id="1"><vmsBoardReference signalId="6" vmsIndex="0"/></vmsGroup>)"),
  };
}

std::string contents_of(RoadMap map) {
  map.mends.clear();
  return encode_map(map, {});
}

/// Kinds of faults of one map that another lacks, and their repairs.
std::string repairs_beyond(const RoadMap& map, const RoadMap& other) {
  std::set<RepairKind> known;
  for (const Repair& repair : other.mends) known.insert(repair.kind);
  std::string text;
  for (const RepairGroup& group : group_repairs(map.mends)) {
    if (known.contains(group.kind)) continue;
    text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", to_string(group.kind), action_of(group.kind));
  }
  return text;
}

/// Effect of an element in the importer, as a cell of the table.
std::string done_with(const Element& element) {
  std::optional<RoadMap> with, without;
  try {
    with = parse_opendrive(element.with, "FILE");
    without = parse_opendrive(element.without, "FILE");
  } catch (const Error& error) {
    return with ? "read, and required" : fmt::format("refused: `{}`", error.what());
  }
  const std::string repairs = repairs_beyond(*with, *without);
  if (!repairs.empty()) return repairs;
  const bool is_missed = !repairs_beyond(*without, *with).empty();
  return is_missed || contents_of(*with) != contents_of(*without) ? "read" : "ignored";
}

TEST(OpenDriveElements, TheTableListsTheHandlingOfEachElement) {
  std::string table = "| element | versions | what is done |\n|---|---|---|\n";
  for (const Element& element : elements()) {
    table += fmt::format("| {} | {} | {} |\n", element.path, element.versions, done_with(element));
  }
  const std::string docs = read_file(PICTURA_OPENDRIVE_DOCS);
  EXPECT_TRUE(docs.find(table) != std::string::npos) << "expected in docs/reference/opendrive_conformance.md:\n"
                                                     << table;
}

}  // namespace
}  // namespace pictura
