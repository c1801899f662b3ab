// A scene in device memory, for tests of renderers that read it there.
#pragma once

#include "pictura/common/cuda/device_buffer.cuh"
#include "pictura/common/renderer.h"

namespace pictura {

/// A host scene's copy in device memory.
struct DeviceScene {
  DeviceBuffer<int32_t> world_begin, geometry, light_begin, hidden_agents;
  DeviceBuffer<AgentBox> agents;
  DeviceBuffer<LightState> light_states;
  explicit DeviceScene(const SceneBatch& host)
      : world_begin(host.world_begin),
        geometry(host.geometry),
        light_begin(host.light_begin),
        hidden_agents(host.hidden_agents),
        agents(host.agents),
        light_states(host.light_states) {}
  SceneBatch batch() const {
    return {MemorySpace::cuda,  world_begin.span(),  agents.span(),       geometry.span(),
            light_begin.span(), light_states.span(), hidden_agents.span()};
  }
};

}  // namespace pictura
