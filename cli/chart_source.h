// Text of bindings/pictura/plot.py, embedded by cmake/EmbedTexts.cmake.
#pragma once

#include <string_view>

namespace pictura::chart_source {

std::string_view plot_py();

}  // namespace pictura::chart_source
