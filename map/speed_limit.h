// The default speed limit, shared by importers and simulator rules.
#pragma once

namespace pictura {

constexpr float kDefaultSpeedLimit_mps = 15.0f;

}  // namespace pictura
