#include "pictura/training/memory.h"

#include <algorithm>

#include "pictura/common/error.h"
#include "pictura/common/image.h"
#include "pictura/common/scene_history.h"
#include "pictura/training/rollout.h"

namespace pictura {

namespace {

// Of one agent at one step.
double observation_bytes(const Config& config) {
  double bytes = 0;
  allocate_observations(config, 1, 1, Device{}).map([&bytes](const at::Tensor& t) {
    bytes += static_cast<double>(t.nbytes());
    return t;
  });
  return bytes;
}

// Of the largest that the run will draw.
double image_bytes(const Config& config) {
  const auto bytes_at = [&config](int64_t agent_steps) {
    return static_cast<double>(image_layout(rig_of(config, agent_steps), 1, PixelFormat::u8).bytes());
  };
  double most = bytes_at(0);
  for (const auto& change : config.render.schedule) most = std::max(most, bytes_at(change.agent_steps));
  return most;
}

// State and its snapshot, box, view and what a step needs, without observations: 690 were measured on the host.
constexpr double kSimulatorBytesPerBox = 700;

// Of a transition: the scalars of a rollout (values, actions, log-probabilities, rewards, advantages, three flags), and
// those that an update makes of them (returns, actions and five lists of rows as i64).
constexpr double kTransitionBytes = 5 * 4 + 3 + 4 + 6 * 8;

}  // namespace

double estimated_bytes(const Config& config, Device device) {
  const Config::SimulatorSection& section = config.simulator;
  const double agents = section.num_slots, steps = config.train.num_steps;
  const double worlds = 2 * agents / (section.min_agents + section.max_agents),
               boxes = agents + worlds * section.parked_cars;
  // The simulator has observations of its own, the rollout those of one step more than it takes.
  double bytes =
      boxes * kSimulatorBytesPerBox + agents * (observation_bytes(config) * (steps + 2) + kTransitionBytes * steps);
  if (!config.reads_images()) return bytes;
  if (keeps_images(config, device)) return bytes + agents * image_bytes(config) * (steps + 1);
  const SceneHistorySize scenes{static_cast<int>(steps) + 1, static_cast<size_t>(worlds), static_cast<size_t>(boxes), 0,
                                static_cast<size_t>(agents)};
  return bytes + static_cast<double>(bytes_of(scenes));
}

void check_memory(const Config& config, Device device, int64_t memory_bytes, int num_ranks) {
  const double needed = estimated_bytes(config, device) / num_ranks, available = static_cast<double>(memory_bytes);
  if (needed <= available) return;
  fail(
      "train: {} agents (simulator.num_slots) with rollouts of {} steps (train.num_steps) need {:.3g} GB {}by "
      "estimate, "
      "the network not counted; {} has {:.3g} GB: about {} agents would fit",
      config.simulator.num_slots, config.train.num_steps, needed / 1e9,
      num_ranks > 1 ? fmt::format("on each of {} ranks ", num_ranks) : "", name_of(device), available / 1e9,
      static_cast<int64_t>(config.simulator.num_slots * (available / needed)));
}

}  // namespace pictura
