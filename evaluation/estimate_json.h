// Estimates in JSON.
#pragma once

#include <string>

#include "pictura/common/support/json.h"
#include "pictura/evaluation/results.h"

namespace pictura {

/// Adds the keys `name` and `name` + "_half_width_95".
inline void add_estimate(const std::string& name, const Estimate& estimate, Json* json_out) {
  (*json_out)[name] = finite_or_null(estimate.value);
  (*json_out)[name + "_half_width_95"] = finite_or_null(estimate.half_width_95);
}

/// Returns a row's counts and metrics, without density and driver.
inline Json row_json(const EvaluateRow& row) {
  Json json = {{"scenarios", row.scenarios},
               {"steps", row.steps},
               {"asked", row.asked},
               {"spawned", row.spawned},
               {"entered", row.entered},
               {"left", row.left},
               {"vehicle_episodes", row.vehicle_episodes},
               {"infractions", row.counts_infractions() ? Json(row.infractions) : Json(nullptr)},
               {"km_driven", row.km_driven},
               {"red_waits", row.red_waits}};
  for (const auto& [name, estimate] : metrics_of(row)) add_estimate(name, estimate, &json);
  for (const auto& [name, estimate] : rates_per_km_of(row)) add_estimate(name, estimate, &json);
  return json;
}

}  // namespace pictura
