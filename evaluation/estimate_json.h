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
               {"infractions", row.infractions},
               {"km_driven", row.km_driven},
               {"red_waits", row.red_waits}};
  for (const auto& [name, estimate] : metrics_of(row)) add_estimate(name, estimate, &json);
  add_estimate("at_fault_collisions_per_km", row.at_fault_collisions_per_km, &json);
  add_estimate("off_road_per_km", row.off_road_per_km, &json);
  add_estimate("red_lights_per_km", row.red_lights_per_km, &json);
  add_estimate("goals_per_km", row.goals_per_km, &json);
  return json;
}

}  // namespace pictura
