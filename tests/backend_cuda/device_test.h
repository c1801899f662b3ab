// The fixture of tests that need a CUDA device. Without one they are skipped, unless PICTURA_REQUIRE_GPU=1 says that
// there must be one.
#pragma once

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

namespace pictura {

std::string cuda_unavailable();

namespace test {

class DeviceTest : public testing::Test {
 protected:
  void SetUp() override {
    const std::string why = cuda_unavailable();
    if (why.empty()) return;
    const char* required = std::getenv("PICTURA_REQUIRE_GPU");
    if (required && std::string(required) == "1") FAIL() << "PICTURA_REQUIRE_GPU=1, but " << why;
    GTEST_SKIP() << "no CUDA device: " << why;
  }
};

}  // namespace test
}  // namespace pictura
