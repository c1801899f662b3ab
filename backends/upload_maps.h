// From a simulator's maps to the renderers that draw its scenes.
#pragma once

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Uploads the simulator's maps to the handles that its scene names them by.
inline void upload_maps(const Simulator& simulator, Renderer* renderer_out, Stream stream = {}) {
  for (std::size_t i = 0; i < simulator.maps().size(); ++i) {
    renderer_out->upload(simulator.handles()[i], simulator.maps()[i]->geometry, stream);
  }
}

}  // namespace pictura
