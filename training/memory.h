// Estimates of the memory that a configuration's agents, network and maps need, before anything is allocated.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Returns whether rollouts of this number of agents keep the policy's images instead of drawing them again, as
/// train.images specifies. With "auto", the host keeps images, because drawing costs more than memory there. A GPU
/// keeps images if they take at most two fifths of its `memory_bytes`.
bool keeps_images(const Config& config, int num_agents, Device device, int64_t memory_bytes);

/// Returns how many images are kept of an agent that is active in all num_steps steps of a rollout. The agent selects
/// an action every decision_steps steps; images of other steps are not kept.
constexpr int64_t num_kept_images(int64_t num_steps, int decision_steps) { return num_steps / decision_steps + 1; }

/// Returns the estimated bytes of simulator, rollout and update for all agents of a configuration. Counts only memory
/// that grows with simulator.num_slots, not maps or the network.
double estimated_bytes(const Config& config, bool keeps_images);

/// Size of a configuration's network. A backbone program (policy.backbone) is not counted.
struct NetworkSize {
  double parameters = 0;
  /// Bytes of each parameter, its gradient and its moments.
  static constexpr double kBytesPerParameter = 20;
  /// Estimated bytes of a transition in a forward and backward pass, with the largest images of render.schedule.
  double transition_bytes = 0;
  /// Returns the bytes needed to process this number of transitions together.
  double bytes(double transitions) const { return kBytesPerParameter * parameters + transition_bytes * transitions; }
};
NetworkSize network_size(const Config& config, Device device);

/// Throws Error if an estimate exceeds `memory_bytes` of the device. One estimate is for the network with
/// train.forward_chunk transitions at once, another for the network and the agents. The error names the responsible
/// settings, and the number of transitions or agents that would fit. With several ranks, both estimates are for one
/// rank.
void check_memory(const Config& config, Device device, int64_t memory_bytes, int num_ranks = 1);

/// Estimated bytes of maps.
struct MapMemory {
  double host = 0;    // maps as loaded, with the data for rules and renderers
  double device = 0;  // data for rules and renderers, on a device
};
/// Estimates the memory of maps from the sizes of map files and of procedural towns. names: names of maps as
/// training_maps() returns them. The estimate is rarely too small. Throws as map_file_bytes() does.
MapMemory estimated_map_memory(const std::vector<std::string>& names);

/// Throws Error if a run's maps do not fit into memory; the error gives the number of maps that would fit. Maps, agents
/// and network together must fit in `memory_bytes` of the device. If the device is not the host, the maps must also fit
/// in `host_memory_bytes`.
void check_map_memory(const Config& config, Device device, int64_t memory_bytes, int64_t host_memory_bytes,
                      int num_ranks = 1);

}  // namespace pictura
