// Writes car.png: a street with a car, seen by the front camera of a car behind it.
#include <cstdio>

#include "pictura/backends/make_renderer.h"

int main() try {
  using namespace pictura;
  StaticGeometry street;
  const Rgb orange{1.0f, 0.6f, 0.1f};  // colours are 0 to 1 here, 0 to 255 in scene files and pictures
  for (const float y_m : {-5.0f, 2.0f}) {
    const std::vector<Vec3> line_m{{0, y_m, 0}, {100, y_m, 0}};
    append_strips(line_m, 0.2f, orange, StripKind::lane_mark, &street.strips);
  }
  street.build_grids();

  SceneOwner scene;
  scene.agents.push_back(make_box(AgentClass::vehicle, {15, -1.5f, 0}, 0.2f, {4.5f, 1.9f, 1.5f}));
  const GeometryHandle handle = 0;
  scene.end_world(handle);

  RendererConfig config;
  config.rig = paper_rig(640, 360);
  const auto renderer = make_renderer("cpu", config);
  renderer->upload(handle, street);
  HostImages images(config.rig, 1);
  const std::vector<View> views{make_view({0, -1.5f, 0}, 0)};
  renderer->render(scene.batch(), views, images.batch());
  write_png("car.png", 640, 360, images.interleaved(0, 0));
} catch (const pictura::Error& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
