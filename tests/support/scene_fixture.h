// A synthetic scene, and writers of it in every format that scenes are read from. So tests need no external files,
// whose licences forbid shipping them.
#pragma once

#include <cstdint>
#include <string>
#include <vector>

#include "pictura/map/scenario/logged_scene.h"

namespace pictura::test {

struct FixtureOptions {
  uint64_t seed = 1;
  int num_steps = 91;
  int num_vehicles = 8;  // half of them move along lanes
  int num_pedestrians = 3, num_cyclists = 1;
  int lane_points = 81;  // points of each straight lane, 0.5 m apart
  bool has_lights = true;
};

/// Makes a crossing of two two-way roads: an approach and an exit lane at each of four arms, lanes straight on and to
/// the right through the junction, borders and edges with the road on their left, broken and double lines, a crosswalk,
/// a stop sign and lights that change. Tracks have gaps, and invalid states with a centre. Places are kilometres from
/// the origin, as in real recordings.
LoggedScene make_fixture(const FixtureOptions& options = {});

/// Style of a written WOMD record; readers must accept all styles.
struct WomdStyle {
  bool descending_fields = false;  // field numbers fall within each message
  bool packed = false;             // pack repeated numbers that proto2 leaves unpacked
  bool unknown_fields = false;     // add unknown fields of all wire types to every message
};

/// Returns the scene as a waymo.open_dataset.Scenario message.
std::string write_womd(const LoggedScene& scene, const WomdStyle& style = {});

/// Returns the same message as protobuf's JSON, by field names instead of numbers, for an independent encoder.
std::string write_womd_json(const LoggedScene& scene);

/// Returns records as a TFRecord file.
std::string write_tfrecord(const std::vector<std::string>& records);

/// Returns GPUDrive's JSON. Links, widths and limits, which the format lacks, are lost.
std::string write_gpudrive(const LoggedScene& scene);

enum class PufferLayout { v1, v2, v2_with_id, v3c };
/// Returns PufferDrive's binary layouts; numbers are rounded to float.
std::string write_pufferdrive(const LoggedScene& scene, PufferLayout layout);
/// Returns v3c with the tagged tails that its reader knows: phases, then `width_m` for every lane point.
std::string write_pufferdrive_tails(const LoggedScene& scene, float width_m);

}  // namespace pictura::test
