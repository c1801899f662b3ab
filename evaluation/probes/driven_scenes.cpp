#include "pictura/evaluation/probes/driven_scenes.h"

#include <algorithm>
#include <cmath>

#include "pictura/common/error.h"
#include "pictura/evaluation/evaluate.h"
#include "pictura/policy/learning_device.h"

namespace pictura {

const DrivenState& DrivenScene::at(int step, int32_t agent) const {
  const auto agents = static_cast<size_t>(world.num_agents);
  const size_t last = states.size() / agents - 1;
  return states[std::min(static_cast<size_t>(step), last) * agents + static_cast<size_t>(agent)];
}

AgentBox DrivenScene::box_at(int step, int32_t agent) const {
  const DrivenState& state = at(step, agent);
  AgentBox box = bodies[agent];
  box.cos_heading = std::cos(state.heading_rad);
  box.sin_heading = std::sin(state.heading_rad);
  const float ahead = ahead_m[agent];
  box.center_m = state.position_m + Vec3{box.cos_heading * ahead, box.sin_heading * ahead, 0};
  return box;
}

void DrivenScene::command_places(int step, Command* commands_out) const {
  for (int32_t agent = 0; agent < world.num_agents; ++agent) {
    const DrivenState& state = at(step, agent);
    commands_out[agent] = {.kind = CommandKind::kinematic_state,
                           .x_m = state.position_m.x,
                           .y_m = state.position_m.y,
                           .z_m = state.position_m.z,
                           .heading_rad = state.heading_rad,
                           .speed_mps = state.speed_mps};
  }
}

void DrivenScenes::add(Simulator& simulator, int driver) {
  const Device device = simulator.device();
  const AgentStateView state = simulator.state();
  const auto slots = static_cast<size_t>(simulator.num_slots());
  const auto copy = [&](const auto* field) { return host_copy(Span(field, slots), device); };
  const std::vector<float> x_m = copy(state.x_m), y_m = copy(state.y_m), z_m = copy(state.z_m),
                           heading_rad = copy(state.heading_rad), speed_mps = copy(state.speed_mps);
  const std::vector<int32_t> lane = copy(state.lane);
  const std::vector<AgentStatus> status = copy(state.status);
  const std::vector<int32_t> slot_begin = host_copy(simulator.slots().slot_begin, device);
  for (size_t world = 0; world < simulator.worlds().size(); ++world) {
    const WorldSpec& spec = simulator.worlds()[world];
    DrivenScene& scene = scenes_[static_cast<int32_t>(spec.global_world - kFirstEvaluationWorld)];
    const auto first = static_cast<size_t>(slot_begin[world]), end = static_cast<size_t>(slot_begin[world + 1]);
    if (scene.states.empty()) {
      scene.world = spec;
      scene.driver = driver;
      const std::vector<AgentBox> boxes = host_copy(simulator.scene().agents, device);
      const auto begin = boxes.begin() + host_copy(simulator.scene().world_begin, device)[world];
      scene.bodies.assign(begin, begin + spec.num_agents);
      for (size_t slot = first; slot < end; ++slot) {
        scene.ahead_m.push_back(length(scene.bodies[slot - first].center_m.xy() - Vec2{x_m[slot], y_m[slot]}));
      }
    }
    for (size_t slot = first; slot < end; ++slot) {
      scene.states.push_back(
          {{x_m[slot], y_m[slot], z_m[slot]}, heading_rad[slot], speed_mps[slot], lane[slot], status[slot]});
    }
  }
}

}  // namespace pictura
