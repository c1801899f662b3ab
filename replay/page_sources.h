// Templates of replay/page/, embedded by cmake/EmbedTexts.cmake.
#pragma once

#include <string_view>

namespace pictura::page {

std::string_view replay_html();
std::string_view gallery_html();

}  // namespace pictura::page
