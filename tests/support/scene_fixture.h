// A synthetic scene of our own, and writers of it in every format that scenes are read from: tests need no file of
// others, whose licences forbid to ship them.
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
  int lane_points = 81;  // of each straight lane, 0.5 m apart
  bool has_lights = true;
};

/// A crossing of two two-way roads: an approach and an exit lane at each of four arms, lanes straight on and to the
/// right through the junction, borders and edges with the road on their left, broken and double lines, a crosswalk, a
/// stop sign, lights that change, tracks with gaps, and states that are not valid but carry a centre. Places are
/// kilometres from the origin, as in real recordings.
LoggedScene make_fixture(const FixtureOptions& options = {});

/// How a WOMD record is written; readers must read all of it.
struct WomdStyle {
  bool descending_fields = false;  // field numbers fall within each message
  bool packed = false;             // repeated numbers that proto2 leaves unpacked
  bool unknown_fields = false;     // of all wire types, in every message
};

/// The scene as a waymo.open_dataset.Scenario message.
std::string write_womd(const LoggedScene& scene, const WomdStyle& style = {});

/// The same message as protobuf's JSON, by field names instead of numbers, for an independent encoder.
std::string write_womd_json(const LoggedScene& scene);

/// Records as a TFRecord file.
std::string write_tfrecord(const std::vector<std::string>& records);

/// GPUDrive's JSON. What the format lacks (links, widths, limits) is lost.
std::string write_gpudrive(const LoggedScene& scene);

enum class PufferLayout { v1, v2, v2_with_id, v3c };
/// PufferDrive's binary layouts; numbers are rounded to float.
std::string write_pufferdrive(const LoggedScene& scene, PufferLayout layout);
/// v3c with the tagged tails that its reader knows: phases, then this width for every lane point.
std::string write_pufferdrive_tails(const LoggedScene& scene, float width_m);

}  // namespace pictura::test
