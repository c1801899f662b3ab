#include "pictura/map/opendrive/repair_links.h"

#include <cmath>
#include <limits>
#include <optional>

#include "pictura/map/opendrive/curves.h"

namespace pictura::opendrive {

namespace {

// Maximum distance at which road ends count as touching. It is used to repair links. A link that both roads contain is
// never removed because of its distance.
constexpr double kTouch_m = 1.0;

const char* name_of(ContactPoint end) { return end == ContactPoint::start ? "start" : "end"; }

ContactPoint other_end(ContactPoint end) {
  return end == ContactPoint::start ? ContactPoint::end : ContactPoint::start;
}

const RoadLink& link_at(const FileRoad& road, ContactPoint end) {
  return end == ContactPoint::start ? road.predecessor : road.successor;
}

RoadLink* link_at(FileRoad* road, ContactPoint end) {
  return end == ContactPoint::start ? &road->predecessor : &road->successor;
}

/// Removes a road's link, but keeps its location. The location shows to later checks of lane links that the file has a
/// link.
void clear_link(RoadLink* link) {
  link->kind = RoadLink::Kind::none;
  link->id.clear();
}

/// Returns the position where the lanes of a road begin or end: on its reference line, moved by the lane offset.
Eigen::Vector3d position_of(const FileRoad& road, ContactPoint end) {
  const FileSection& section = end == ContactPoint::start ? road.sections.front() : road.sections.back();
  const double s = end == ContactPoint::start ? 0 : road.length;
  return point_at(road, s, border_at(road, section, 0, s).t);
}

double distance_m(const FileRoad& a, ContactPoint end_a, const FileRoad& b, ContactPoint end_b) {
  return (position_of(a, end_a) - position_of(b, end_b)).norm();
}

/// Returns the end of `b` that touches the given end of `a`. If both ends or neither end of `b` touch it, returns
/// `contact`.
ContactPoint touching_end(const FileRoad& a, ContactPoint end, const FileRoad& b, ContactPoint contact) {
  const bool touches = distance_m(a, end, b, contact) <= kTouch_m;
  return !touches && distance_m(a, end, b, other_end(contact)) <= kTouch_m ? other_end(contact) : contact;
}

class LinkRepairer {
 public:
  LinkRepairer(Network* network, Faults* faults) : network_(*network), faults_(faults) {}

  void repair() {
    for (FileRoad& road : network_.roads) {
      if (!road.junction.empty() && !network_.junction_index.contains(road.junction)) {
        road.where.record_repair(faults_, RepairKind::missing_junction, "belongs to junction {}, which does not exist",
                                 road.junction);
        road.junction.clear();
      }
      for (const ContactPoint end : {ContactPoint::start, ContactPoint::end}) check_target(&road, end);
    }
    for (FileRoad& road : network_.roads) {
      for (const ContactPoint end : {ContactPoint::start, ContactPoint::end}) check_return(&road, end);
    }
    for (FileJunction& junction : network_.junctions) {
      std::erase_if(junction.connections, [&](Connection& c) { return !find_ends(junction, &c); });
    }
  }

 private:
  FileRoad* road_named(const std::string& id) {
    const auto found = network_.road_index.find(id);
    return found == network_.road_index.end() ? nullptr : &network_.roads[found->second];
  }

  /// Checks that the target of a road's link exists, and that the contact point is the end of the target that touches
  /// the road.
  void check_target(FileRoad* road, ContactPoint end) {
    RoadLink* const link = link_at(road, end);
    if (link->kind == RoadLink::Kind::junction && !network_.junction_index.contains(link->id)) {
      link->where.record_repair(faults_, RepairKind::missing_junction, "refers to junction {}, which does not exist",
                                link->id);
      clear_link(link);
    }
    if (link->kind != RoadLink::Kind::road) return;
    const FileRoad* const target = road_named(link->id);
    if (!target) {
      link->where.record_repair(faults_, RepairKind::missing_road, "refers to road {}, which does not exist", link->id);
      clear_link(link);
      return;
    }
    if (!link->has_contact) {
      const bool is_start =
          distance_m(*road, end, *target, ContactPoint::start) <= distance_m(*road, end, *target, ContactPoint::end);
      link->contact = is_start ? ContactPoint::start : ContactPoint::end;
      link->has_contact = true;
    } else if (const ContactPoint contact = touching_end(*road, end, *target, link->contact);
               contact != link->contact && !(target == road && contact == end)) {
      link->where.record_repair(faults_, RepairKind::wrong_end,
                                "attribute contactPoint: expected {}, which touches the {} of this road, got {}",
                                name_of(contact), name_of(end), name_of(link->contact));
      link->contact = contact;
    }
  }

  /// Checks that a link between two roads is mutual. If the linked end of the other road is linked to a third road, the
  /// link is kept only if the two ends touch.
  void check_return(FileRoad* road, ContactPoint end) {
    RoadLink* const link = link_at(road, end);
    if (link->kind != RoadLink::Kind::road) return;
    FileRoad* const target = road_named(link->id);
    RoadLink* const back = link_at(target, link->contact);
    if (target == road && (link->contact == end || back->kind != RoadLink::Kind::road)) {
      link->where.record_repair(faults_, RepairKind::contrary_link,
                                "its {} is linked to the road's own {}, which is not linked back", name_of(end),
                                name_of(link->contact));
      clear_link(link);
      return;
    }
    if (back->kind == RoadLink::Kind::none) {
      link->where.record_repair(faults_, RepairKind::one_sided_link,
                                "the {} of road {} is not linked back to the {} of this road", name_of(link->contact),
                                link->id, name_of(end));
      *back = {.kind = RoadLink::Kind::road, .id = road->id, .contact = end, .where = target->where};
      return;
    }
    if (back->kind != RoadLink::Kind::road || (back->id == road->id && back->contact == end)) return;
    const bool touches = distance_m(*road, end, *target, link->contact) <= kTouch_m;
    link->where.record_repair(faults_, touches ? RepairKind::unreturned_link : RepairKind::contrary_link,
                              "the {} of road {} is linked to the {} of road {} instead of the {} of this road",
                              name_of(link->contact), link->id, name_of(back->contact), back->id, name_of(end));
    if (!touches) clear_link(link);
  }

  /// Finds the ends where the two roads of a connection meet. The connecting road's link determines them if it exists,
  /// else the incoming road's link to the junction, else geometry. If the roads do not meet, records the repair (the
  /// caller omits the connection) and returns false.
  bool find_ends(const FileJunction& junction, Connection* connection) {
    const FileRoad* const incoming = road_named(connection->incoming_road);
    const FileRoad* const connecting = road_named(connection->connecting_road);
    for (const auto& [road, id] :
         {std::pair(incoming, &connection->incoming_road), std::pair(connecting, &connection->connecting_road)}) {
      if (road) continue;
      connection->where.record_repair(faults_, RepairKind::missing_road, "refers to road {}, which does not exist",
                                      *id);
      return false;
    }
    const auto is_back = [&](ContactPoint contact) {
      const RoadLink& back = link_at(*connecting, contact);
      return back.kind == RoadLink::Kind::road && back.id == connection->incoming_road;
    };
    if (!is_back(connection->contact) && is_back(other_end(connection->contact)) &&
        !touches(*incoming, *connecting, connection->contact)) {
      note_wrong_end(*connection);
      connection->contact = other_end(connection->contact);
    } else if (!connection->has_contact && !touches(*incoming, *connecting, connection->contact) &&
               touches(*incoming, *connecting, other_end(connection->contact))) {
      connection->contact = other_end(connection->contact);
    }
    connection->has_contact = true;
    if (is_back(connection->contact)) {
      connection->incoming_end = link_at(*connecting, connection->contact).contact;
      return true;
    }
    for (const ContactPoint end : {ContactPoint::end, ContactPoint::start}) {
      const RoadLink& link = link_at(*incoming, end);
      if (link.kind != RoadLink::Kind::junction || link.id != junction.id) continue;
      connection->incoming_end = end;
      return true;
    }
    return find_ends_by_geometry(*incoming, *connecting, connection);
  }

  static bool touches(const FileRoad& incoming, const FileRoad& connecting, ContactPoint contact) {
    return distance_m(incoming, ContactPoint::start, connecting, contact) <= kTouch_m ||
           distance_m(incoming, ContactPoint::end, connecting, contact) <= kTouch_m;
  }

  void note_wrong_end(const Connection& connection) {
    if (!connection.has_contact) return;  // already recorded
    connection.where.record_repair(
        faults_, RepairKind::wrong_end, "attribute contactPoint: expected {}, which is linked to road {}, got {}",
        name_of(other_end(connection.contact)), connection.incoming_road, name_of(connection.contact));
  }

  bool find_ends_by_geometry(const FileRoad& incoming, const FileRoad& connecting, Connection* connection) {
    for (const ContactPoint contact : {connection->contact, other_end(connection->contact)}) {
      for (const ContactPoint end : {ContactPoint::end, ContactPoint::start}) {
        if (distance_m(incoming, end, connecting, contact) > kTouch_m) continue;
        connection->where.record_repair(
            faults_, RepairKind::one_sided_link,
            "its incoming road {} has no link to this junction; its {} touches the {} of road {}", incoming.id,
            name_of(end), name_of(contact), connecting.id);
        connection->contact = contact;
        connection->incoming_end = end;
        return true;
      }
    }
    connection->where.record_repair(faults_, RepairKind::unconnected_road,
                                    "its incoming road {} has no end at this junction", connection->incoming_road);
    return false;
  }

  Network& network_;
  Faults* faults_;
};

}  // namespace

void repair_links(Network* network, Faults* faults) { LinkRepairer(network, faults).repair(); }

}  // namespace pictura::opendrive
