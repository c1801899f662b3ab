// The speed limit where the map file gives none, for importers and for the rules of the simulator alike.
#pragma once

namespace pictura {

constexpr float kDefaultSpeedLimit_mps = 15.0f;

}  // namespace pictura
