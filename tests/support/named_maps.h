// Functions for tests that are parameterized by map name.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/map/load_map.h"
#include "pictura/map/map_copy.h"

namespace pictura::test {

/// Returns a message if the map file is missing; empty otherwise.
inline std::string missing(const std::string& map) {
  const std::vector<std::string> towns = known_towns();
  const std::string town(parse_map_copy(map).map);
  const bool is_present = !town.starts_with("Town") || std::binary_search(towns.begin(), towns.end(), town);
  return is_present ? "" : "needs " + town + ".xodr; set PICTURA_DATA";
}

inline std::string map_name(const ::testing::TestParamInfo<const char*>& map) {
  std::string name = map.param;
  for (const char mark : {':', '#'}) std::replace(name.begin(), name.end(), mark, '_');
  return name;
}

}  // namespace pictura::test
