// Section [evaluate] of a configuration.
#pragma once

#include <array>

#include "pictura/simulator/conditioning.h"

namespace pictura {

struct EvaluateSection {
  /// Conditioning of every agent: [evaluate.conditioning] NAME = value.
  std::array<double, kNumConditioning> conditioning = default_conditioning();
  static std::array<double, kNumConditioning> default_conditioning();
};

}  // namespace pictura
