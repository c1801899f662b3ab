// Tests that take a map's name: whether there is such a map, and the name as a part of the test's.
#pragma once

#include <algorithm>
#include <string>
#include <vector>

#include <gtest/gtest.h>

#include "pictura/map/load_map.h"

namespace pictura::test {

/// What a test of a map needs and does not find; empty where it is there.
inline std::string missing(const std::string& map) {
  const std::vector<std::string> towns = known_towns();
  const bool is_there = !map.starts_with("Town") || std::binary_search(towns.begin(), towns.end(), map);
  return is_there ? "" : "needs " + map + ".xodr; set PICTURA_DATA";
}

/// Names tests by their map.
inline std::string map_name(const testing::TestParamInfo<const char*>& map) {
  std::string name = map.param;
  std::replace(name.begin(), name.end(), ':', '_');
  return name;
}

}  // namespace pictura::test
