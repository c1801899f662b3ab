// What stands on and beside a road: objects (crosswalks, parking spaces), signals and references to them.
#include "pictura/map/opendrive/read_parts.h"

namespace pictura::opendrive {

void read_objects(const Element& road_element, FileRoad* road) {
  const Element objects = road_element.child("objects");
  if (!objects) return;
  objects.each("object", [&](const Element& element) {
    FileObject object;
    object.type = element.text("type", "none");
    if (object.type != "crosswalk" && object.type != "parking" && object.type != "parkingSpace") return;
    object.where = element.where();
    object.s = element.number_in("s", -kMaxRoadLength_m, kMaxRoadLength_m);
    object.t = element.number_in("t", -kMaxRoadLength_m, kMaxRoadLength_m);
    object.z_offset = element.number("zOffset", 0);
    object.heading = element.number("hdg", 0);
    object.length = element.number("length", 0);
    object.width = element.number("width", 0);
    Element outline = element.child("outline");
    if (!outline) {
      if (const Element outlines = element.child("outlines")) outline = outlines.child("outline");
    }
    if (outline) {
      outline.each_child([&](const Element& corner) {
        if (corner.name() == "cornerLocal") {
          object.outline.push_back({corner.number("u"), corner.number("v"), corner.number("z", 0), false});
        } else if (corner.name() == "cornerRoad") {
          object.outline.push_back({corner.number("s"), corner.number("t"), corner.number("dz", 0), true});
        }
      });
    }
    road->objects.push_back(std::move(object));
  });
}

void read_signals(const Element& road_element, FileRoad* road) {
  const Element signals = road_element.child("signals");
  if (!signals) return;
  signals.each("signal", [&](const Element& element) {
    FileSignal signal;
    signal.where = element.where();
    signal.id = element.text("id");
    signal.type = element.text("type", "");
    signal.s = element.number_in("s", -kMaxRoadLength_m, kMaxRoadLength_m);
    signal.t = element.number_in("t", -kMaxRoadLength_m, kMaxRoadLength_m);
    signal.z_offset = element.number("zOffset", 0);
    road->signals.push_back(std::move(signal));
  });
  signals.each("signalReference", [&](const Element& element) {
    SignalReference reference;
    reference.where = element.where();
    reference.signal = element.text("id");
    reference.s = element.number_in("s", -kMaxRoadLength_m, kMaxRoadLength_m);
    bool any = false;
    element.each("validity", [&](const Element& validity) {
      reference.from_lane = validity.integer("fromLane");
      reference.to_lane = validity.integer("toLane");
      road->signal_references.push_back(reference);
      any = true;
    });
    if (!any) road->signal_references.push_back(reference);
  });
}

}  // namespace pictura::opendrive
