// Charts: drawn by bindings/pictura/plot.py with Matplotlib. This program carries that file's text and runs it by a
// Python.
#pragma once

#include <string_view>
#include <vector>

#include "pictura/common/error_types.h"
#include "pictura/common/image.h"
#include "pictura/common/support/json.h"

namespace pictura {

/// No Python, or one without Matplotlib; says how to get it, and where the chart's data is.
class NoMatplotlib : public Error {
 public:
  using Error::Error;
};

/// Has plot.py answer a request: a chart's name ("chart") and arguments, the picture's name ("out") and what to print
/// ("report"). The Python is that of $PICTURA_PYTHON, else of the virtual environment that this program was built with,
/// else python3. Throws Error with plot.py's message, NoMatplotlib, or Interrupted at ^C.
void draw_chart(const Json& request);

/// The colours that plot.py lists under a name, as SERIES_COLORS, for pictures beside charts.
std::vector<Rgb> chart_colors(std::string_view name);

}  // namespace pictura
