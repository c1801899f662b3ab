// Page templates in which {{name}} stands for a text.
#pragma once

#include <string>
#include <string_view>
#include <utility>
#include <vector>

#include <nlohmann/json.hpp>

namespace pictura {

std::string html_text(std::string_view text);

/// Returns JSON for an HTML script element; no string in the JSON can end the element.
std::string script_text(const nlohmann::ordered_json& json);

/// Replaces each {{name}} by its value. Every name must occur.
std::string fill_template(std::string_view html, const std::vector<std::pair<std::string, std::string>>& values);

}  // namespace pictura
