// Coefficients of the conditioning by name, for configurations, commands and callers from other languages.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/simulator/conditioning.h"

namespace pictura {

/// The largest absolute value of a coefficient.
constexpr double kMaxConditioning = 1e6;

/// The index of the coefficient of this name in the order of Conditioning. Throws UsageError that begins with `where`,
/// as "--conditioning", and suggests the nearest name.
std::size_t conditioning_index(std::string_view name, const std::string& where);

}  // namespace pictura
