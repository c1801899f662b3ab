// Fills templates of pages, in which {{name}} stands for a text.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace pictura {

/// Escapes a text for HTML.
std::string html_text(std::string_view text);

/// Returns JSON text for an HTML script element. It is escaped so that no string in it can end the element.
std::string script_text(const nlohmann::ordered_json& json);

/// Returns the template with each {{name}} replaced by its value. Every name must occur in the template.
std::string fill_template(std::string_view html, const std::vector<std::pair<std::string, std::string>>& values);

}  // namespace pictura
