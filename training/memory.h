// Whether a configuration's agents and network fit into memory, before anything is made.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Whether rollouts of so many agents keep the images that a policy sees, rather than drawing them again: as
/// train.images says; with auto on the host, where drawing costs more than memory, and on a device where they take at
/// most a quarter of its `memory_bytes`.
bool keeps_images(const Config& config, int num_agents, Device device, int64_t memory_bytes);

/// What simulator, rollout and update take for all agents of a configuration, by estimate: what grows with
/// simulator.num_slots, so neither maps nor the network.
double estimated_bytes(const Config& config, bool keeps_images);

/// What the network of a configuration takes. A program (policy.backbone) is not counted: what it computes is its own.
struct NetworkSize {
  double parameters = 0;
  /// Of each parameter, its gradients and what the optimizer keeps.
  static constexpr double kBytesPerParameter = 20;
  /// Of a transition on its way forward and back, by estimate, the largest of render.schedule's images included.
  double transition_bytes = 0;
  /// With so many transitions at once.
  double bytes(double transitions) const { return kBytesPerParameter * parameters + transition_bytes * transitions; }
};
NetworkSize network_size(const Config& config, Device device);

/// Throws Error naming the settings that decide, and what would fit, where the estimates exceed `memory_bytes` of the
/// device: for the network with a chunk of train.forward_chunk, and for it and the agents; with several ranks, for each
/// one's part.
void check_memory(const Config& config, Device device, int64_t memory_bytes, int num_ranks = 1);

/// What maps take by estimate, in bytes.
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
