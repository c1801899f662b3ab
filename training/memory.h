// Estimates of memory before any is allocated.
#pragma once

#include "pictura/configuration/config.h"

namespace pictura {

/// Whether rollouts keep the policy's images instead of drawing them again, as train.images specifies. With "auto", the
/// host keeps them, because drawing costs more than memory there. A GPU keeps images that take at most two fifths of
/// `memory_bytes`.
bool keeps_images(const Config& config, int num_agents, Device device, int64_t memory_bytes);

/// Returns the number of images that a rollout keeps of an agent that is always active. Only steps at which the agent
/// selects an action keep images.
constexpr int64_t num_kept_images(int64_t num_steps, int decision_steps) { return num_steps / decision_steps + 1; }

/// Estimated bytes of simulator, rollout and update for all agents.
double estimated_bytes(const Config& config, bool keeps_images);

/// Size of a configuration's network; does not count a backbone program (policy.backbone).
struct NetworkSize {
  double parameters = 0;
  /// Bytes of parameter, gradient, two moments, average, and the three gradients of GradientDiagnosis.
  static constexpr double kBytesPerParameter = 32;
  /// Estimated bytes per transition of a forward and backward pass, with the largest images of render.schedule.
  double transition_bytes = 0;
  double bytes(double transitions) const { return kBytesPerParameter * parameters + transition_bytes * transitions; }
};
NetworkSize network_size(const Config& config, Device device);

/// Throws Error if one rank needs more than `memory_bytes` of the device. It first checks the network (with
/// train.forward_chunk transitions), then the network together with the rank's agents. The error names the settings,
/// and how many transitions or agents would fit.
void check_memory(const Config& config, Device device, int64_t memory_bytes, int num_ranks = 1);

/// Estimated bytes of maps.
struct MapMemory {
  double host = 0;    // maps with data for rules and renderers
  double device = 0;  // data for rules and renderers
};
/// Estimates the memory from the sizes of map files and procedural towns; the result is rarely too small. Throws as
/// map_file_bytes() does. names: those of training_maps().
MapMemory estimated_map_memory(const std::vector<std::string>& names);

/// Throws Error if a run's maps do not fit, with the number that would fit. Maps, agents and network must fit in
/// `memory_bytes` of the device. If the device is not the host, maps must also fit in `host_memory_bytes`.
void check_map_memory(const Config& config, Device device, int64_t memory_bytes, int64_t host_memory_bytes,
                      int num_ranks = 1);

}  // namespace pictura
