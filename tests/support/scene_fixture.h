// A synthetic recorded scene in every readable format, because licences forbid copies of external data sets.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/map/scenario/logged_scene.h"

namespace pictura::test {

struct FixtureOptions {
  uint64_t seed = 1;
  int num_steps = 91;
  int num_vehicles = 8;  // half of them drive
  int num_pedestrians = 3, num_cyclists = 1;
  int lane_points = 81;  // points of each straight lane, 0.5 m apart
  bool has_lights = true;
};

/// Makes a crossing of two two-way roads. Each arm has an approach lane and an exit lane; lanes through the junction
/// lead straight on and to the right. Borders and edges have the road on their left. Tracks have gaps, and some invalid
/// states have a position. All positions are kilometres from the origin, as in recordings.
LoggedScene make_fixture(const FixtureOptions& options = {});

/// Style of a record of the Waymo Open Motion Dataset (WOMD).
struct WomdStyle {
  bool descending_fields = false;  // fields in descending order of their numbers
  bool packed = false;             // packed repeated numbers, unlike in proto2
  bool unknown_fields = false;     // unknown fields of all wire types
};

/// Returns the scene as a waymo.open_dataset.Scenario message.
std::string write_womd(const LoggedScene& scene, const WomdStyle& style = {});

/// Returns write_womd() as Protocol Buffers JSON with field names.
std::string write_womd_json(const LoggedScene& scene);

std::string write_tfrecord(const std::vector<std::string>& records);

/// Returns the scene as GPUDrive's JSON, which lacks links, widths and speed limits.
std::string write_gpudrive(const LoggedScene& scene);

enum class PufferLayout { v1, v2, v2_with_id, v3c };
/// Returns a binary layout of PufferDrive, with numbers rounded to float.
std::string write_pufferdrive(const LoggedScene& scene, PufferLayout layout);
/// Returns layout v3c with both tagged tails: phases, then width_m as the width at every lane point.
std::string write_pufferdrive_tails(const LoggedScene& scene, float width_m);

}  // namespace pictura::test
