// Default speed limit of importers and simulator rules.
#pragma once

namespace pictura {

constexpr float kDefaultSpeedLimit_mps = 15.0f;

}  // namespace pictura
