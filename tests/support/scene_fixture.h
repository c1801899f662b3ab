// A synthetic recorded scene, and functions that write it in every format that can be read. So tests need no files of
// external data sets, whose licences forbid copies in this repository.
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

/// Makes a crossing of two two-way roads. Each of the four arms has an approach lane and an exit lane; lanes through
/// the junction lead straight on and to the right. Borders and edges have the road on their left. There are broken and
/// double lines, a crosswalk, a stop sign and lights that change. Tracks have gaps, and some invalid states have a
/// position. All positions are kilometres from the origin, as in real recordings.
LoggedScene make_fixture(const FixtureOptions& options = {});

/// Style of a written record of the Waymo Open Motion Dataset (WOMD). Readers must accept all styles.
struct WomdStyle {
  bool descending_fields = false;  // fields of each message are in descending order of their numbers
  bool packed = false;             // repeated numbers are packed, although proto2 does not pack them
  bool unknown_fields = false;     // every message also has unknown fields of all wire types
};

/// Returns the scene as a waymo.open_dataset.Scenario message.
std::string write_womd(const LoggedScene& scene, const WomdStyle& style = {});

/// Returns the message of write_womd() as Protocol Buffers JSON, with field names instead of numbers. An independent
/// encoder can encode it.
std::string write_womd_json(const LoggedScene& scene);

/// Returns records as a TFRecord file.
std::string write_tfrecord(const std::vector<std::string>& records);

/// Returns the scene as GPUDrive's JSON. The format has no links, widths and speed limits, so these are lost.
std::string write_gpudrive(const LoggedScene& scene);

enum class PufferLayout { v1, v2, v2_with_id, v3c };
/// Returns the scene in a binary layout of PufferDrive, with numbers rounded to float.
std::string write_pufferdrive(const LoggedScene& scene, PufferLayout layout);
/// Returns the scene in layout v3c with both tagged tails that the reader knows: phases, then width_m as the width at
/// every lane point.
std::string write_pufferdrive_tails(const LoggedScene& scene, float width_m);

}  // namespace pictura::test
