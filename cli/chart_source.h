// Text of bindings/pictura/plot.py, which the build embeds (cmake/EmbedTexts.cmake).
#pragma once

#include <string_view>

namespace pictura::chart_source {

std::string_view plot_py();

}  // namespace pictura::chart_source
