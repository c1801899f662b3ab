// Small Lanelet2 maps as text, in local coordinates.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include <fmt/format.h>

namespace pictura::test {

using TagList = std::vector<std::pair<std::string, std::string>>;

struct OsmMember {
  std::string type, role;
  int ref = 0;
};

/// Builder of a file: one line per element, after two lines of header.
class OsmText {
 public:
  OsmText& node(int id, double x, double y, double z = 0, const std::string& type = "") {
    TagList tags{{"local_x", fmt::format("{}", x)}, {"local_y", fmt::format("{}", y)}, {"ele", fmt::format("{}", z)}};
    if (!type.empty()) tags.emplace_back("type", type);
    return line(fmt::format(R"(<node id="{}" lat="0" lon="0">{}</node>)", id, text_of(tags)));
  }
  OsmText& way(int id, const std::vector<int>& nodes, const TagList& tags = {}) {
    std::string references;
    for (const int node : nodes) references += fmt::format(R"(<nd ref="{}"/>)", node);
    return line(fmt::format(R"(<way id="{}">{}{}</way>)", id, references, text_of(tags)));
  }
  OsmText& relation(int id, const std::vector<OsmMember>& members, const TagList& tags) {
    std::string references;
    for (const OsmMember& member : members) {
      references += fmt::format(R"(<member type="{}" ref="{}" role="{}"/>)", member.type, member.ref, member.role);
    }
    return line(fmt::format(R"(<relation id="{}">{}{}</relation>)", id, references, text_of(tags)));
  }
  /// Adds a lanelet, by default with subtype "road". rules: ids of regulatory elements.
  OsmText& lanelet(int id, int left, int right, TagList tags = {}, const std::vector<int>& rules = {}) {
    std::vector<OsmMember> members{{"way", "left", left}, {"way", "right", right}};
    for (const int rule : rules) members.push_back({"relation", "regulatory_element", rule});
    bool has_subtype = false;
    for (const auto& [key, value] : tags) has_subtype = has_subtype || key == "subtype";
    if (!has_subtype) tags.emplace_back("subtype", "road");
    tags.emplace_back("type", "lanelet");
    return relation(id, members, tags);
  }
  OsmText& line(const std::string& text) {
    body_ += text + "\n";
    return *this;
  }
  std::string text() const { return "<?xml version=\"1.0\"?>\n<osm version=\"0.6\">\n" + body_ + "</osm>\n"; }

 private:
  static std::string text_of(const TagList& tags) {
    std::string text;
    for (const auto& [key, value] : tags) text += fmt::format(R"(<tag k="{}" v="{}"/>)", key, value);
    return text;
  }

  std::string body_;
};

}  // namespace pictura::test
