// Pages from templates, in which {{name}} is replaced by a text.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace pictura {

/// Escapes a text for HTML.
std::string html_text(std::string_view text);

/// Returns JSON for a script element, escaped so that no text in it can end the element.
std::string script_text(const nlohmann::ordered_json& json);

/// Returns the template with each {{name}} replaced; every name must be in it.
std::string fill_template(std::string_view html, const std::vector<std::pair<std::string, std::string>>& values);

}  // namespace pictura
