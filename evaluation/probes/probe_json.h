// What the summaries of all probes have in common, as JSON.
#pragma once

#include "pictura/common/support/json_text.h"
#include "pictura/evaluation/estimate_json.h"
#include "pictura/evaluation/probes/probe_results.h"

namespace pictura {

/// Adds how many cases and scenes there are, and the estimates.
void add_means(const ResponseMeans& means, Json* json_out);

/// The policies, each with how many of the cases are of scenes that it drove. drivers: [cases].
Json policies_json(const ProbeResults& results, const std::vector<int32_t>& drivers);

/// Adds the worlds, who drove them and how, and how long it took.
void add_setting(const ProbeResults& results, Json* json_out);

/// A summary: what it begins with, the setting, and to_json(row) of each row.
template <typename Row, typename ToJson>
std::string summary_text(const ProbeResults& results, Json json, const std::vector<Row>& rows, const ToJson& to_json) {
  add_setting(results, &json);
  Json rows_json = Json::array();
  for (const Row& row : rows) rows_json.push_back(to_json(row));
  json["rows"] = std::move(rows_json);
  return json_text(json, 1);
}

}  // namespace pictura
