// Draws one car in front of the camera and says whether it is there.
#include <cstdio>

#include "pictura/backends/make_renderer.h"
#include "pictura/version.h"

int main() {
  using namespace pictura;
  const auto renderer = make_renderer("cpu", {});
  StaticGeometry nothing;
  nothing.build_grids();
  const GeometryHandle geometry = 0;
  renderer->upload(geometry, nothing);
  const std::vector<int32_t> world_begin{0, 1}, light_begin{0, 0};
  const std::vector<AgentBox> agents{{.center_m = {15, 0, 0}, .length_m = 4.5f, .width_m = 2, .height_m = 1.5f}};
  const std::vector<GeometryHandle> handles{geometry};
  SceneBatch scene;
  scene.world_begin = world_begin;
  scene.agents = agents;
  scene.geometry = handles;
  scene.light_begin = light_begin;
  const std::vector<View> views(1);
  HostImages images(renderer->config().rig, 1);
  renderer->render(scene, views, images.batch());
  int lit = 0;
  for (const uint8_t byte : images.bytes()) lit += byte != 0;
  std::printf("pictura %s drew %d bytes\n", PICTURA_VERSION, lit);
  return lit > 100 ? 0 : 1;
}
