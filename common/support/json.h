// What is written as JSON, which has neither infinity nor NaN.
#pragma once

#include <cmath>

#include <nlohmann/json.hpp>

namespace pictura {

/// Keys keep the order in which they were set.
using Json = nlohmann::ordered_json;

/// The number, or null where it is infinite or NaN.
inline Json finite_or_null(double value) { return std::isfinite(value) ? Json(value) : Json(nullptr); }

}  // namespace pictura
