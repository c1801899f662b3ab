// Draws charts with bindings/pictura/plot.py, which uses Matplotlib. This program contains the text of plot.py, and
// runs it with a Python interpreter.
#pragma once

#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/image.h"
#include "pictura/common/support/json.h"

namespace pictura {

/// Error thrown if Python or Matplotlib is missing. Its message explains how to install them, and where the chart's
/// data is.
class NoMatplotlib : public Error {
 public:
  using Error::Error;
};

/// Runs plot.py on a request. The request contains a chart's name ("chart"), its arguments, and optionally the name of
/// the picture ("out") and the text to print ("report"). The interpreter is $PICTURA_PYTHON if set, else the
/// interpreter of the virtual environment with which this program was built, else python3. Throws NoMatplotlib,
/// Interrupted, or Error with plot.py's message.
void draw_chart(const Json& request);

/// Returns the colours of a list in plot.py, such as SERIES_COLORS, for pictures that accompany charts.
std::vector<Rgb> chart_colors(std::string_view name);

}  // namespace pictura
