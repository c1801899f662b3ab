// Estimates in JSON.
#pragma once

#include <string>

#include "pictura/common/support/json.h"
#include "pictura/evaluation/results.h"

namespace pictura {

/// Adds an estimate as two keys, `name` and `name`_half_width_95.
inline void add_estimate(const std::string& name, const Estimate& estimate, Json* json_out) {
  (*json_out)[name] = finite_or_null(estimate.value);
  (*json_out)[name + "_half_width_95"] = finite_or_null(estimate.half_width_95);
}

}  // namespace pictura
