// Section [evaluate] of a configuration.
#pragma once

#include <array>

#include "pictura/simulator/conditioning.h"

namespace pictura {

struct EvaluateSection {
  /// Conditioning of every agent, written as [evaluate.conditioning] NAME = value in the file.
  std::array<double, kNumConditioning> conditioning = default_conditioning();
  static std::array<double, kNumConditioning> default_conditioning();
};

}  // namespace pictura
