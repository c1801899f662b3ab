#include "pictura/map/opendrive/opendrive.h"

#include <algorithm>
#include <cmath>
#include <filesystem>

#include "pictura/common/error.h"
#include "pictura/map/open_lanes.h"
#include "pictura/map/opendrive/build.h"
#include "pictura/map/opendrive/deform.h"
#include "pictura/map/opendrive/lights.h"
#include "pictura/map/opendrive/reader.h"
#include "pictura/map/opendrive/sections.h"

namespace pictura {

namespace {

/// Budget that bounds the import time of small files and the memory of large ones. CARLA's towns need 0.2 samples per
/// byte, procedural towns 0.7, of which the largest has 35 MB. A straight road of 100 km needs half a million samples.
SampleBudget budget_for(std::size_t text_bytes, const std::string& source, const InterruptibleWork& work) {
  constexpr std::int64_t kBaseSamples = 500'000, kSamplesPerByte = 10, kMaxSamples = 60'000'000;
  return {std::min(kMaxSamples, kBaseSamples + kSamplesPerByte * static_cast<std::int64_t>(text_bytes)), source, work};
}

/// Throws Error unless the singular values of the plan are in [0.5, 1.5] and it does not mirror.
void check_plan(const PlanMap& plan) {
  const double sum = std::hypot(plan.xx + plan.yy, plan.yx - plan.xy);
  const double difference = std::hypot(plan.xx - plan.yy, plan.yx + plan.xy);
  PICTURA_CHECK(
      plan.determinant() > 0 && sum + difference <= 3 && sum - difference >= 1,
      "OpenDRIVE options: expected a plan that does not mirror and stretches by 0.5 to 1.5, got rows ({}, {}) "
      "and ({}, {})",
      plan.xx, plan.xy, plan.yx, plan.yy);
}

/// Imports a network. Faults of the network as a whole do not contain the file's name.
RoadMap import_network(std::string_view text, const std::string& source, const OpenDriveOptions& options,
                       const ImportProgress& progress) {
  const InterruptibleWork work(fmt::format("{}: interrupted while it was imported", source));
  // Shares of the work, measured on large networks.
  const auto begin = [&](const char* stage, double done) {
    work.check();
    if (progress) progress(stage, done);
  };
  begin("reading", 0);
  opendrive::Faults faults(options.strict);
  opendrive::Network network;
  opendrive::read_network(text, source, &faults, &network);
  opendrive::split_at_speed_changes(&network);
  opendrive::split_at_lights(&network);

  RoadMap map;
  map.name = std::filesystem::path(source).stem().string();
  if (options.plan == PlanMap{}) {
    map.geo_reference = network.geo_reference;
  } else {
    opendrive::deform(options.plan, &network);  // a copy has no place on Earth
  }
  opendrive::Build build{network, options, &faults, &map, budget_for(text.size(), source, work), {}, {}, {}};
  begin("lanes", 0.1);
  opendrive::choose_origin(&build);
  opendrive::build_lanes(&build);
  opendrive::link_lanes(&build);
  opendrive::set_speed_limits(&build);
  find_endless_lanes(&map);
  begin("road edges", 0.2);
  opendrive::build_road_edges(&build);
  if (!has_endless_roads(map)) opendrive::open_road_ends(&build);
  begin("markings", 0.8);
  opendrive::build_markings(&build);
  opendrive::build_objects(&build);
  opendrive::build_signals(&build);
  begin("building lines", 0.85);
  opendrive::build_building_lines(&build);
  opendrive::count_facts(&build);
  map.mends = faults.take();
  validate(map);
  return map;
}

}  // namespace

RoadMap parse_opendrive(std::string_view text, const std::string& source, const OpenDriveOptions& options,
                        const ImportProgress& progress) {
  PICTURA_CHECK(options.chord_error_m >= 1e-3f && options.chord_error_m <= 10.0f,
                "OpenDRIVE options: expected a chord error in [0.001, 10] m, got {}", options.chord_error_m);
  check_plan(options.plan);
  try {
    return import_network(text, source, options, progress);
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
