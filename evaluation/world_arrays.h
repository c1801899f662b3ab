// Host copy of the data that evaluation observers read.
#pragma once

#include <cstddef>
#include <cstdint>
#include <vector>

#include "pictura/policy/learning_device.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

struct WorldArrays {
  std::vector<AgentStatus> status;                          // [slots]
  std::vector<AgentClass> agent_class;                      // [slots]
  std::vector<float> speed_mps;                             // [slots]
  std::vector<AgentBox> boxes;                              // by world: agents, then parked cars
  std::vector<LightState> lights;                           // by world: lights of stop lines
  std::vector<int32_t> slot_begin, box_begin, light_begin;  // [worlds + 1]

  explicit WorldArrays(Simulator& simulator)
      : status(values_of_slots(simulator, simulator.state().status)),
        agent_class(values_of_slots(simulator, simulator.state().agent_class)),
        speed_mps(values_of_slots(simulator, simulator.state().speed_mps)),
        boxes(host_copy(simulator.scene().agents, simulator.device())),
        lights(host_copy(simulator.scene().light_states, simulator.device())),
        slot_begin(host_copy(simulator.slots().slot_begin, simulator.device())),
        box_begin(host_copy(simulator.scene().world_begin, simulator.device())),
        light_begin(host_copy(simulator.scene().light_begin, simulator.device())) {}

  template <typename T>
  static std::vector<T> values_of_slots(Simulator& simulator, const T* values) {
    return host_copy(Span<const T>(values, static_cast<size_t>(simulator.num_slots())), simulator.device());
  }

  size_t first_slot(size_t world) const { return static_cast<size_t>(slot_begin[world]); }
  size_t num_agents(size_t world) const { return first_slot(world + 1) - first_slot(world); }
  size_t first_box(size_t world) const { return static_cast<size_t>(box_begin[world]); }
  size_t num_boxes(size_t world) const { return first_box(world + 1) - first_box(world); }
  size_t first_light(size_t world) const { return static_cast<size_t>(light_begin[world]); }
  bool is_red(size_t light) const { return lights[light] == LightState::red; }
};

}  // namespace pictura
