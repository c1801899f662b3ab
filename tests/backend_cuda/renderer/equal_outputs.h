// Comparison of kernels with the oracle (the CPU renderer). Results are bitwise identical, because kernels use its
// rules and sum integers.
#pragma once

#include <cmath>

#include <gtest/gtest.h>

#include "pictura/bench/truth/image_scenes.h"

namespace pictura::test {

inline void expect_equal(const Outputs& actual, const Outputs& oracle) {
  ASSERT_EQ(actual.color.size(), oracle.color.size());
  std::size_t differ = 0;
  for (std::size_t i = 0; i < oracle.color.size(); ++i) differ += actual.color[i] != oracle.color[i];
  EXPECT_EQ(differ, 0u) << "of " << oracle.color.size() << " values";
  EXPECT_TRUE(actual == oracle) << "colours or planes differ";
}

/// Compares each agent's visibility in all views. NaN equals only NaN.
inline void expect_equal_visibility(Renderer* actual, Renderer* oracle, const Snapshot& town) {
  std::vector<VisibilityQuery> queries;
  for (std::size_t view = 0; view < town.views.size(); ++view) {
    for (std::size_t agent = 0; agent < town.scene.agents.size(); ++agent) {
      queries.push_back({static_cast<int32_t>(view), static_cast<int32_t>(agent)});
    }
  }
  std::vector<float> told(queries.size()), expected(queries.size());
  actual->upload(0, town.geometry);
  oracle->upload(0, town.geometry);
  actual->visibility(town.scene.batch(), town.views, queries, told);
  oracle->visibility(town.scene.batch(), town.views, queries, expected);
  for (std::size_t i = 0; i < queries.size(); ++i) {
    if (std::isnan(expected[i])) {
      EXPECT_TRUE(std::isnan(told[i])) << i;
    } else {
      EXPECT_EQ(told[i], expected[i]) << i;
    }
  }
}

}  // namespace pictura::test
