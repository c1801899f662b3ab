#include "pictura/simulator/conditioning_lookup.h"

#include <algorithm>
#include <iterator>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/support/suggestion.h"

namespace pictura {

std::size_t conditioning_index(std::string_view name, const std::string& where) {
  const std::vector<std::string> names(std::begin(kConditioningNames), std::end(kConditioningNames));
  const auto found = std::find(names.begin(), names.end(), name);
  if (found == names.end()) fail_usage("{}: no coefficient '{}'{}", where, name, suggestion(name, names));
  return static_cast<std::size_t>(found - names.begin());
}

}  // namespace pictura
