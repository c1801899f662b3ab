// Upload of compiled maps to renderers.
#pragma once

#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// handles: one per map; empty: 0, 1, ..., which simulators use by default.
inline void upload_maps(const CompiledMaps& maps, Span<const GeometryHandle> handles, Renderer* renderer_out,
                        Stream stream = {}) {
  for (std::size_t i = 0; i < maps.size(); ++i) {
    renderer_out->upload(handles.empty() ? static_cast<GeometryHandle>(i) : handles[i], maps[i]->geometry, stream);
  }
}

/// Uploads the simulator's maps to its handles.
inline void upload_maps(const Simulator& simulator, Renderer* renderer_out, Stream stream = {}) {
  upload_maps(simulator.maps(), simulator.handles(), renderer_out, stream);
}

}  // namespace pictura
