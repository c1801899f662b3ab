#include "pictura/training/memory.h"

#include <algorithm>
#include <cmath>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/common/error.h"
#include "pictura/common/image.h"
#include "pictura/common/scene_history.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/map/load_map.h"
#include "pictura/policy/network_shape.h"
#include "pictura/policy/observation.h"
#include "pictura/policy/rules/network_passes.h"
#include "pictura/simulator/observation_arrays.h"
#include "pictura/training/training_maps.h"

namespace pictura {

namespace {

// Returns the bytes of the observation of one agent at one step.
double observation_bytes(const Config& config) {
  double bytes = 0;
  allocate_observations(config, 1, 1, Device{}).map([&bytes](const at::Tensor& t) {
    bytes += static_cast<double>(t.nbytes());
    return t;
  });
  return bytes;
}

// Returns the bytes of an agent's images at the largest size of the run's schedule.
double image_bytes(const Config& config) {
  const auto bytes_at = [&config](int64_t agent_steps) {
    return static_cast<double>(image_layout(rig_of(config, agent_steps), 1, PixelFormat::u8).bytes());
  };
  double largest = bytes_at(0);
  for (const auto& change : config.render.schedule) largest = std::max(largest, bytes_at(change.agent_steps));
  return largest;
}

// Bytes per box in the simulator, without observations: state and its snapshot, box, view and temporaries of a step. A
// measurement on the host gave 690.
constexpr double kSimulatorBytesPerBox = 700;

// Bytes of a transition: the scalars of a rollout (values, actions, log-probabilities, rewards, advantages, three
// flags), and those of an update (returns, actions and five lists of rows as i64).
constexpr double kTransitionBytes = 5 * 4 + 3 + 4 + 6 * 8;

// Bytes of a map per byte of its file. Both exceed the measured values of CARLA's towns, procedural towns, and copies.
constexpr double kHostBytesPerFileByte = 17, kDeviceBytesPerFileByte = 11;

// Returns the width of the scene encoder's output.
double scene_width(const Config& config) {
  return (config.reads(ObservationPart::walls) ? 5.0 : 4.0) * config.policy.embedding_width;
}

double kept_image_bytes(const Config& config, double agents) {
  return agents * image_bytes(config) * double(num_kept_images(config.train.num_steps, config.policy.decision_steps));
}

}  // namespace

bool keeps_images(const Config& config, int num_agents, Device device, int64_t memory_bytes) {
  if (config.train.images != "auto") return config.train.images == "kept";
  return device.is_host() || kept_image_bytes(config, num_agents) <= 0.4 * static_cast<double>(memory_bytes);
}

double estimated_bytes(const Config& config, bool keeps_images) {
  const SimulatorSection& section = config.simulator;
  const double agents = section.num_slots, steps = config.train.num_steps;
  // Each world of a recorded scene has max_agents slots.
  const int min_agents = section.has_scenes() ? section.max_agents : section.min_agents;
  const double worlds = 2 * agents / (min_agents + section.max_agents),
               boxes = agents + worlds * training_world(config, Device{}).parked_cars;
  // Observations of steps + 2 steps: one step in the simulator, and steps + 1 in the rollout.
  double bytes =
      boxes * kSimulatorBytesPerBox + agents * (observation_bytes(config) * (steps + 2) + kTransitionBytes * steps);
  if (!config.train.teacher.empty()) {
    const double scene = config.train.teacher_scene_coef > 0 ? scene_width(config) : 0;
    bytes += agents * steps * (kNumActions + scene) * sizeof(float);
  }
  if (!config.reads_images()) return bytes;
  if (keeps_images) return bytes + kept_image_bytes(config, agents);
  const SceneHistorySize scenes{static_cast<int>(steps) + 1, static_cast<size_t>(worlds), static_cast<size_t>(boxes), 0,
                                static_cast<size_t>(agents)};
  return bytes + static_cast<double>(bytes_of(scenes));
}

namespace {

// Sums the sizes of a network's layers.
class LayerSum {
 public:
  /// Adds a linear layer or a convolution that maps `rows` rows of `in` numbers to rows of `out` numbers. `kept`:
  /// number of copies of its results that the backward pass needs; two if an activation follows.
  void add(double rows, double in, double out, double kept, double kernel_area = 1) {
    parameters_ += (in * kernel_area + 1) * out;
    add_values(rows * out, kept);
    largest_ = std::max(largest_, rows * (in + out));
  }
  /// Adds a two-layer group. If the norm is a separate pass, the activation's input is kept in addition to the first
  /// layer's results.
  void add_group(double rows, double in, double width, bool keeps_norm, double kept = 1) {
    add(rows, in, width, keeps_norm ? 3 : 2);
    add(rows, width, width, kept);
  }
  void add_parameters(double count) { parameters_ += count; }
  void add_values(double count, double kept) { kept_ += kept * count; }

  double parameters() const { return parameters_; }
  /// Returns how many numbers a transition needs: those that all layers keep, and the gradients at the largest layer.
  double values() const { return kept_ + 2 * largest_; }

 private:
  double parameters_ = 0, kept_ = 0, largest_ = 0;
};

// Whether a device's memory suffices for one pass over sets; true for devices that this machine lacks.
bool fits_set_encoder(Device device, double channels) {
  return !cuda_unavailable_reason().empty() ||
         make_network_passes(device)->fits_set_encoder(static_cast<int64_t>(channels));
}

void add_entity_sets(const Config& config, Device device, LayerSum* sum) {
  const double width = config.policy.embedding_width;
  for (const ObservationArray& array : kObservationArrays) {
    if (!is_set(array) || !config.reads(array.part)) continue;
    const double features = array.features + row_features_of(config.policy, array.name).count();
    const bool is_one_pass =
        device.is_host() || (config.train.precision == Precision::bf16 && fits_set_encoder(device, width) &&
                             SetSize::supports(config.policy.embedding_width, config.policy.embedding_width,
                                               static_cast<int64_t>(features), array.rows));
    if (is_one_pass) {
      // The indices of the largest members are kept, and the features of members on the host: see largest_embedding().
      sum->add_parameters((features + 1) * width + (width + 1) * width);
      if (device.is_host()) sum->add_values(array.rows * features, 1);
      sum->add_values(width, 1);
      continue;
    }
    sum->add_values(array.rows * features, 2);
    const bool keeps_norm = config.policy.layer_norm && !NetworkPasses::supports_norm(config.policy.embedding_width);
    sum->add_group(array.rows, features, width, keeps_norm, 2);
  }
}

// Adds the image branch at the image size of this rig.
void add_images(const Config& config, const Rig& rig, LayerSum* sum) {
  const PolicySection& policy = config.policy;
  const double cameras = static_cast<double>(rig.cameras.size()), queries = policy.num_queries;
  const bool is_program = policy.backbone != "conv";
  double channels = 3.0 * policy.patch_px * policy.patch_px, pixels = 0;
  for (const Camera& camera : rig.cameras) {
    pixels +=
        std::ceil(double(camera.width_px) / policy.patch_px) * std::ceil(double(camera.height_px) / policy.patch_px);
  }
  sum->add_values(pixels * channels, 1);
  for (size_t i = 0; i < policy.conv_channels.size() && !is_program; ++i) {
    pixels /= policy.conv_strides[i] * policy.conv_strides[i];
    const bool keeps_norm = policy.conv_norm && !NetworkPasses::supports_norm(policy.conv_channels[i]);
    sum->add(pixels, channels, policy.conv_channels[i], keeps_norm ? 3 : 2,
             policy.conv_kernels[i] * policy.conv_kernels[i]);
    channels = policy.conv_channels[i];
  }
  const double width = channels, rows = cameras * queries, scores = pixels * queries * policy.attention_heads;
  sum->add_parameters((kPositionFeatures + 1) * width + 4 * width + rows * width + 4 * width * width + 3 * width);
  sum->add_values(pixels * width, 2);  // tokens before and after their norm
  sum->add_values(scores, 2);
  sum->add_values(rows * policy.attention_heads * width, 1);
  sum->add_values(rows * width, 3);
  if (policy.attention_mlp > 0) {
    sum->add_parameters(2 * width);
    sum->add(rows, width, policy.attention_mlp, 2);
    sum->add(cameras * num_camera_features(policy), policy.attention_mlp, width, 2);
  }
  const double features = cameras * num_camera_features(policy) * width;
  sum->add_values(features, 1);
  sum->add(1, features, 4.0 * policy.embedding_width, 1);
}

LayerSum layers_of(const Config& config, const Rig& rig, Device device) {
  const PolicySection& policy = config.policy;
  LayerSum sum;
  config.reads_images() ? add_images(config, rig, &sum) : add_entity_sets(config, device, &sum);
  const double width = policy.embedding_width,
               waypoint = kWaypointFeatures + row_features_of(policy, "waypoints").count();
  sum.add_group(1, num_ego_features(config.reads_images()), width, policy.layer_norm);
  sum.add_group(1, kNumConditioning + kNumWaypoints * waypoint, width, policy.layer_norm);
  const double in = scene_width(config) + 2 * width, inside = policy.backbone_width;
  sum.add_values(in, 1);
  for (int i = 0; i < policy.backbone_layers; ++i) {
    sum.add(1, i == 0 ? in : inside, inside, policy.layer_norm ? 3 : 2);
  }
  sum.add(1, inside, kNumActions, 3);
  sum.add(1, inside, 1, 1);
  return sum;
}

}  // namespace

NetworkSize network_size(const Config& config, Device device) {
  NetworkSize size;
  const double value_bytes = !device.is_host() && config.train.precision == Precision::bf16 ? 2 : 4;
  const auto add = [&](int64_t agent_steps) {
    const Config in_force = config_at(config, agent_steps);
    const LayerSum sum = layers_of(in_force, rig_of(in_force, agent_steps), device);
    size.parameters = sum.parameters();
    size.transition_bytes = std::max(size.transition_bytes, sum.values() * value_bytes + observation_bytes(config));
  };
  add(0);
  for (const auto& change : config.render.schedule) add(change.agent_steps);
  return size;
}

void check_memory(const Config& config, Device device, int64_t memory_bytes, int num_ranks) {
  const double available = static_cast<double>(memory_bytes);
  const NetworkSize network = network_size(config, device);
  const auto chunk = static_cast<double>(std::min(config.train.forward_chunk, config.train.minibatch_size));
  if (network.bytes(chunk) > available) {
    const double fitting = std::floor((available - network.bytes(0)) / network.transition_bytes);
    fail(
        "train: a network of {:.3g} million parameters needs {:.3g} GB by estimate, {:.3g} GB of which for {} "
        "transitions at once (train.forward_chunk); {} has {:.3g} GB: {}",
        network.parameters / 1e6, network.bytes(chunk) / 1e9, network.transition_bytes * chunk / 1e9, chunk,
        name_of(device), available / 1e9,
        fitting >= 1 ? fmt::format("about {} transitions would fit", fitting)
                     : "it does not fit, see policy.backbone_width, embedding_width and the convolutions' channels");
  }
  const bool keeps = keeps_images(config, config.simulator.num_slots / num_ranks, device, memory_bytes);
  const double needed = estimated_bytes(config, keeps) / num_ranks, left = available - network.bytes(chunk);
  if (needed <= left) return;
  fail(
      "train: {} agents (simulator.num_slots) with rollouts of {} steps (train.num_steps) need {:.3g} GB {}by "
      "estimate, "
      "and the network {:.3g} GB; {} has {:.3g} GB: about {} agents would fit",
      config.simulator.num_slots, config.train.num_steps, needed / 1e9,
      num_ranks > 1 ? fmt::format("on each of {} ranks ", num_ranks) : "", network.bytes(chunk) / 1e9, name_of(device),
      available / 1e9, static_cast<int64_t>(config.simulator.num_slots * (left / needed)));
}

MapMemory estimated_map_memory(const std::vector<std::string>& names) {
  MapMemory memory;
  for (const std::string& name : names) {
    const auto file_bytes = static_cast<double>(map_file_bytes(name));
    memory.host += kHostBytesPerFileByte * file_bytes;
    memory.device += kDeviceBytesPerFileByte * file_bytes;
  }
  return memory;
}

void check_map_memory(const Config& config, Device device, int64_t memory_bytes, int64_t host_memory_bytes,
                      int num_ranks) {
  if (config.simulator.has_scenes()) return;  // the sizes of recorded scenes are known only when they are loaded
  const std::vector<std::string> names = training_maps(config);
  const MapMemory maps = estimated_map_memory(names);
  const auto check = [&](Device where, double needed, double available) {
    if (needed <= available) return;
    fail(
        "train: {} maps (simulator.maps, and simulator.map_copies of each) need {:.3g} GB by estimate; {} has {:.3g} "
        "GB "
        "for them: about {} such maps would fit",
        names.size(), needed / 1e9, name_of(where), available / 1e9,
        static_cast<int64_t>(static_cast<double>(names.size()) * std::max(available, 0.0) / needed));
  };
  const auto chunk = static_cast<double>(std::min(config.train.forward_chunk, config.train.minibatch_size));
  const bool keeps = keeps_images(config, config.simulator.num_slots / num_ranks, device, memory_bytes);
  const double left = static_cast<double>(memory_bytes) - network_size(config, device).bytes(chunk) -
                      estimated_bytes(config, keeps) / num_ranks;
  check(device, device.is_host() ? maps.host : maps.device, left);
  if (!device.is_host()) check(Device{}, maps.host, static_cast<double>(host_memory_bytes));
}

}  // namespace pictura
