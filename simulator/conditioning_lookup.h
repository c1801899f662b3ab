// Lookup of conditioning coefficients by name.
#pragma once

#include <cstddef>
#include <string>
#include <string_view>

#include "pictura/common/error_types.h"
#include "pictura/simulator/conditioning.h"

namespace pictura {

/// Maximum absolute value of a coefficient.
constexpr double kMaxConditioning = 1e6;

/// Returns the index of a coefficient in Conditioning. Throws UsageError for an unknown name. The message begins with
/// `where` and suggests the nearest name.
std::size_t conditioning_index(std::string_view name, const std::string& where);

}  // namespace pictura
