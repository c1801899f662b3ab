// The synthetic scene of scene_fixture.h as a Scenario.
#pragma once

#include <memory>

#include "pictura/map/scenario/scenario.h"
#include "pictura/tests/support/scene_fixture.h"

namespace pictura::test {

inline std::shared_ptr<const Scenario> crossing(const FixtureOptions& options = {}) {
  return std::make_shared<const Scenario>(make_scenario(make_fixture(options)));
}

}  // namespace pictura::test
