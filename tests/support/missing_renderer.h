// Skips tests without a renderer's library.
#pragma once

#include <cstdlib>
#include <string>

#include <gtest/gtest.h>

#include "pictura/backends/make_renderer.h"
#include "pictura/common/error_types.h"

namespace pictura {

/// Returns why a renderer cannot run here; empty if it can. The test fails if PICTURA_REQUIRE_GL names the renderer.
inline std::string missing(const std::string& backend) {
  try {
    make_renderer(backend, {});
    return "";
  } catch (const Error& error) {
    const char* required = std::getenv("PICTURA_REQUIRE_GL");
    if (required && std::string(required).find(backend) != std::string::npos) {
      ADD_FAILURE() << "PICTURA_REQUIRE_GL=" << required << ", but " << error.what();
    }
    return error.what();
  }
}

}  // namespace pictura
