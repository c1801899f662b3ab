// Options that a struct lists once: visit_options(options, visitor) calls the visitor with each and its value. Python
// takes its keyword arguments from such a list, commands their flags.
#pragma once

#include <limits>

namespace pictura {

/// An option and what is to be said of it beside its type and default.
struct NamedOption {
  const char* name;                                        // in Python
  const char *flag = nullptr, *help = nullptr;             // in commands, where it has one
  double low = 0, high = std::numeric_limits<int>::max();  // what numbers the flag takes
};

}  // namespace pictura
