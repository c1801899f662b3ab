// Shared JSON of the probes' summaries.
#pragma once

#include "pictura/common/support/json_text.h"
#include "pictura/evaluation/estimate_json.h"
#include "pictura/evaluation/probes/probe_results.h"

namespace pictura {

/// Adds the numbers of cases and scenes, and the estimates.
void add_means(const ResponseMeans& means, Json* json_out);

/// Returns the policies, each with the number of scenes that it drove, and the number of cases in these scenes.
/// drivers: [cases] driver indices.
Json policies_json(const ProbeResults& results, const std::vector<int32_t>& drivers);

/// Adds the settings, interruption and duration.
void add_setting(const ProbeResults& results, Json* json_out);

/// Returns the text of `json`, the setting, and to_json(row) of each row.
template <typename Row, typename ToJson>
std::string summary_text(const ProbeResults& results, Json json, const std::vector<Row>& rows, const ToJson& to_json) {
  add_setting(results, &json);
  Json rows_json = Json::array();
  for (const Row& row : rows) rows_json.push_back(to_json(row));
  json["rows"] = std::move(rows_json);
  return json_text(json, 1);
}

}  // namespace pictura
