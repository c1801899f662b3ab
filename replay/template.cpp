#include "pictura/replay/template.h"

#include <map>

#include "pictura/common/error.h"
#include "pictura/common/support/json_text.h"

namespace pictura {

std::string html_text(std::string_view text) {
  std::string html;
  for (const char c : text) {
    switch (c) {
      case '<': html += "&lt;"; break;
      case '>': html += "&gt;"; break;
      case '&': html += "&amp;"; break;
      case '"': html += "&quot;"; break;
      default: html += c;
    }
  }
  return html;
}

std::string script_text(const nlohmann::ordered_json& json) {
  std::string text;
  for (const char c : json_text(json)) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

std::string fill_template(std::string_view html, const std::vector<std::pair<std::string, std::string>>& values) {
  // Names are searched only in the template, not in the values that replace other names.
  // Key: begin of a name. Value: its length, and its replacement.
  std::map<size_t, std::pair<size_t, const std::string*>> places;
  for (const auto& [name, text] : values) {
    const std::string mark = "{{" + name + "}}";
    const size_t at = html.find(mark);
    PICTURA_CHECK(at != std::string_view::npos, "template: expected {} in it", mark);
    places[at] = {mark.size(), &text};
  }
  std::string page;
  size_t end = 0;
  for (const auto& [begin, place] : places) {
    page += html.substr(end, begin - end);
    page += *place.second;
    end = begin + place.first;
  }
  return page += html.substr(end);
}

}  // namespace pictura
