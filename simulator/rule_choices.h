// Rules of the world of which a configuration chooses one, where several are sensible. Both devices read them.
#pragma once

#include "pictura/common/portable/hd.h"

namespace pictura {

/// How the traffic lights of a junction go together: the phases of the junction take turns, or each light cycles alone
/// and knows nothing of the others.
enum class LightCycles : uint8_t { phases, independent };

/// Names as configuration files and options spell them, in the order of LightCycles.
constexpr const char* kLightCyclesNames[] = {"phases", "independent"};

constexpr const char* name_of(LightCycles cycles) { return kLightCyclesNames[static_cast<int>(cycles)]; }

}  // namespace pictura
