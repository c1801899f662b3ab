// Charts, drawn by bindings/pictura/plot.py with Matplotlib. This program contains that file's text and runs it with a
// Python interpreter.
#pragma once

#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/image.h"
#include "pictura/common/support/json.h"

namespace pictura {

/// Error thrown if there is no Python, or no Matplotlib; explains how to install it, and where the chart's data is.
class NoMatplotlib : public Error {
 public:
  using Error::Error;
};

/// Runs plot.py on a request: a chart's name ("chart") and arguments, the name of the picture ("out") and the text to
/// print ("report"). The interpreter is $PICTURA_PYTHON, else that of the virtual environment that this program was
/// built with, else python3. Throws Error with plot.py's message, NoMatplotlib, or Interrupted.
void draw_chart(const Json& request);

/// Colours of a list in plot.py, such as SERIES_COLORS, for pictures beside charts.
std::vector<Rgb> chart_colors(std::string_view name);

}  // namespace pictura
