#include "pictura/map/import.h"

#include <algorithm>
#include <cstdint>
#include <filesystem>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/common/hypot.h"

namespace pictura {

namespace {

void check(const OpenDriveOptions& options) {
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

}  // namespace

MapImport::MapImport(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& import_options,
                     const ImportProgress& progress)
    : options(import_options),
      faults(import_options.strict),
      text_bytes_(text_bytes),
      source_(source),
      progress_(progress),
      work_(fmt::format("{}: interrupted while it was imported", source)) {
  map.name = std::filesystem::path(source).stem().string();
}

void MapImport::begin(const char* stage, double done) const {
  work_.check();
  if (progress_) progress_(stage, done);
}

// CARLA's towns need 0.2 samples per byte. Procedural towns need 0.7, and the largest has 35 MB. A straight road of 100
// km needs half a million samples.
SampleBudget MapImport::budget() const {
  constexpr std::int64_t kBaseSamples = 500'000, kSamplesPerByte = 10, kMaxSamples = 60'000'000;
  return {std::min(kMaxSamples, kBaseSamples + kSamplesPerByte * static_cast<std::int64_t>(text_bytes_)), source_,
          work_};
}

RoadMap import_map(std::size_t text_bytes, const std::string& source, const OpenDriveOptions& options,
                   const ImportProgress& progress, const std::function<void(MapImport* import)>& fill) {
  check(options);
  try {
    MapImport import(text_bytes, source, options, progress);
    fill(&import);
    import.map.mends = import.faults.take();
    validate(import.map);
    return std::move(import.map);
  } catch (const Interrupted&) {
    throw;
  } catch (const UsageError&) {
    throw;
  } catch (const Error& error) {
    const std::string message = error.what();
    if (message.starts_with(source)) throw;
    fail("{}: {}", source, message);
  }
}

}  // namespace pictura
