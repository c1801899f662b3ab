#include "pictura/replay/template.h"

#include "pictura/common/error.h"

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
  for (const char c : json.dump()) {
    if (c == '<')
      text += "\\u003c";
    else
      text += c;
  }
  return text;
}

std::string filled(std::string_view html, const std::vector<std::pair<std::string, std::string>>& values) {
  std::string page(html);
  for (const auto& [name, text] : values) {
    const std::string mark = "{{" + name + "}}";
    const size_t at = page.find(mark);
    PICTURA_CHECK(at != std::string::npos, "template: expected {} in it", mark);
    page.replace(at, mark.size(), text);
  }
  return page;
}

}  // namespace pictura
