#include "pictura/map/import.h"

#include <algorithm>
#include <cmath>
#include <cstdint>

#include "pictura/common/hypot.h"

namespace pictura {

void check_import_options(const OpenDriveOptions& options) {
  PICTURA_CHECK(options.chord_error_m >= 1e-3f && options.chord_error_m <= 10.0f,
                "import options: expected a chord error in [0.001, 10] m, got {}", options.chord_error_m);
  const PlanMap& plan = options.plan;
  const double sum = hypot_of(plan.xx + plan.yy, plan.yx - plan.xy);
  const double difference = hypot_of(plan.xx - plan.yy, plan.yx + plan.xy);
  PICTURA_CHECK(plan.determinant() > 0 && sum + difference <= 3 && sum - difference >= 1,
                "import options: expected a plan that does not mirror and stretches by 0.5 to 1.5, got rows ({}, {}) "
                "and ({}, {})",
                plan.xx, plan.xy, plan.yx, plan.yy);
}

/// CARLA's towns need 0.2 samples per byte, procedural ones 0.7, of which the largest has 35 MB, and a straight road of
/// 100 km half a million.
SampleBudget import_budget(std::size_t text_bytes, const std::string& source, const InterruptibleWork& work) {
  constexpr std::int64_t kBaseSamples = 500'000, kSamplesPerByte = 10, kMaxSamples = 60'000'000;
  return {std::min(kMaxSamples, kBaseSamples + kSamplesPerByte * static_cast<std::int64_t>(text_bytes)), source, work};
}

}  // namespace pictura
