// Iteration over the primitives that an image may show, in an order that depends only on the scene.
#pragma once

#include "pictura/common/raster/face_setup.h"

namespace pictura {

template <typename Visit>
PICTURA_HD inline void visit_agents(const ImageSetting& setting, const SceneBatch& scene, const View& view,
                                    Visit&& visit) {
  const auto world = static_cast<size_t>(view.world);
  for (int32_t agent = scene.world_begin[world]; agent < scene.world_begin[world + 1]; ++agent) {
    const AgentBox& box = scene.agents[agent];
    if (!may_be_visible(box, setting.camera, setting.frustum)) continue;
    if (!is_excluded(view, scene.hidden_agents, agent)) visit(box, agent);
  }
}

template <typename Visit>
PICTURA_HD inline void visit_walls(const ImageSetting& setting, const StaticGeometryView& geometry, Visit&& visit) {
  const Span<const WallFace> walls = geometry.walls;
  for_each_item(
      geometry.wall_grid, frustum_ground_box(setting.camera, setting.frustum),
      [&](int32_t i) { return ground_box(walls[i]); },
      [&](int32_t i) {
        const WallFace& wall = walls[i];
        if (may_be_visible(wall, setting.camera, setting.frustum)) visit(wall, i);
      });
}

/// States of the lights that a view's images show.
PICTURA_HD inline Span<const LightState> light_states_of(const SceneBatch& scene, const View& view) {
  if ((view.hides & kHidesLights) != 0) return {};
  const int32_t begin = scene.light_begin[view.world];
  const int32_t end = scene.light_begin[static_cast<size_t>(view.world) + 1];
  return {scene.light_states.data() + begin, static_cast<size_t>(end - begin)};
}

template <typename Visit>
PICTURA_HD inline void visit_lights(const ImageSetting& setting, const StaticGeometryView& geometry,
                                    const SceneBatch& scene, const View& view, Visit&& visit) {
  const Span<const LightState> states = light_states_of(scene, view);
  if (states.empty()) return;
  const Span<const LightHead> heads = geometry.heads;
  for (int32_t i = 0; i < static_cast<int32_t>(heads.size()); ++i) {
    const LightHead& head = heads[i];
    if (!may_be_visible(head, setting.camera, setting.frustum)) continue;
    visit(head, states[head.signal], i);
  }
}

template <typename Visit>
PICTURA_HD inline void visit_strips(const ImageSetting& setting, const StaticGeometryView& geometry, Visit&& visit) {
  const Span<const Strip> strips = geometry.strips;
  for_each_item(
      geometry.strip_grid, frustum_ground_box(setting.camera, setting.frustum),
      [&](int32_t i) { return ground_box(strips[i]); },
      [&](int32_t i) {
        const Strip& strip = strips[i];
        if (may_be_visible(strip, setting.camera, setting.frustum)) visit(strip, i);
      });
}

}  // namespace pictura
