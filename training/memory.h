// Estimates of the memory that a configuration's agents, network and maps need, before anything is allocated.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Whether rollouts of so many agents keep the images that a policy sees, rather than drawing them again: as
/// train.images says; with auto on the host, where drawing costs more than memory, and on a device where they take at
/// most two fifths of its `memory_bytes`.
bool keeps_images(const Config& config, int num_agents, Device device, int64_t memory_bytes);

/// Images that a rollout of num_steps keeps of an agent that is active all the time: where an action is held, none.
constexpr int64_t num_kept_images(int64_t num_steps, int decision_steps) { return num_steps / decision_steps + 1; }

/// Estimated bytes of simulator, rollout and update for all agents of a configuration: what grows with
/// simulator.num_slots, so neither maps nor the network.
double estimated_bytes(const Config& config, bool keeps_images);

/// Size of a configuration's network. A program (policy.backbone) is not counted.
struct NetworkSize {
  double parameters = 0;
  /// Bytes of each parameter, its gradient and its moments.
  static constexpr double kBytesPerParameter = 20;
  /// Estimated bytes of a transition on its way forward and back, with the largest images of render.schedule.
  double transition_bytes = 0;
  /// Bytes with so many transitions at once.
  double bytes(double transitions) const { return kBytesPerParameter * parameters + transition_bytes * transitions; }
};
NetworkSize network_size(const Config& config, Device device);

/// Throws Error naming the settings that decide, and what would fit, where the estimates exceed `memory_bytes` of the
/// device: for the network with a chunk of train.forward_chunk, and for it and the agents; with several ranks, for each
/// one's part.
void check_memory(const Config& config, Device device, int64_t memory_bytes, int num_ranks = 1);

/// Estimated bytes of maps.
struct MapMemory {
  double host = 0;    // as they are loaded, with what rules and renderers read
  double device = 0;  // what rules and renderers read of them, on a device
};
/// Estimate of the memory of these maps, as training_maps() names them, from the sizes of their files and towns; seldom
/// less than they take. Throws as map_file_bytes() does.
MapMemory estimated_map_memory(const std::vector<std::string>& names);

/// Throws Error saying how many maps would fit where those of a run do not: neither beside the agents and the network
/// in `memory_bytes` of the device, nor, of a device that is not the host, in `host_memory_bytes`.
void check_map_memory(const Config& config, Device device, int64_t memory_bytes, int64_t host_memory_bytes,
                      int num_ranks = 1);

}  // namespace pictura
