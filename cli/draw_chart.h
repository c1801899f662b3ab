// Charts by bindings/pictura/plot.py.
#pragma once

#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/image.h"
#include "pictura/common/support/json.h"

namespace pictura {

/// Error: Python or Matplotlib is missing. The message explains the installation, and locates the chart's data.
class NoMatplotlib : public Error {
 public:
  using Error::Error;
};

/// Runs plot.py. The request contains the chart's name ("chart"), its arguments, and optionally a picture's name
/// ("out") and a text to print ("report"). The interpreter is $PICTURA_PYTHON, else that of the build's virtual
/// environment, else python3. Throws NoMatplotlib, Interrupted, or Error with plot.py's message.
void draw_chart(const Json& request);

/// Returns the colours of a list in plot.py, such as SERIES_COLORS.
std::vector<Rgb> chart_colors(std::string_view name);

}  // namespace pictura
