#include "pictura/bench/truth/image_scenes.h"

#include <random>

namespace pictura {

void add_polyline(StaticGeometry* geometry, std::vector<Vec3> points_m, float width_m, StripKind kind) {
  const Rgb color = kind == StripKind::road_edge   ? kRoadEdgeColor
                    : kind == StripKind::crosswalk ? kCrosswalkColor
                    : kind == StripKind::stop_line ? kStopLineColor
                                                   : kWhiteMarkColor;
  append_strips(points_m, width_m, color, kind, &geometry->strips);
}

namespace {

constexpr float kBlock_m = 60.0f;
constexpr int kBlocks = 5;
constexpr float kHalfRoad_m = 7.0f;

// Whether the bounding circles of two boxes are disjoint. Then their footprints are disjoint too.
bool apart(const AgentBox& a, const AgentBox& b) {
  auto radius = [](const AgentBox& box) { return 0.5f * length(Vec2{box.length_m, box.width_m}); };
  return length(a.center_m.xy() - b.center_m.xy()) > radius(a) + radius(b) + 0.1f;
}

}  // namespace

Snapshot make_synthetic_town(uint64_t seed, int num_agents) {
  std::mt19937_64 random(seed);
  auto uniform = [&](float low, float high) {
    return low + (high - low) * static_cast<float>(random() >> 40) / static_cast<float>(1 << 24);
  };
  Snapshot town;
  StaticGeometry& geometry = town.geometry;

  // Streets along x and y. at(u, v) is the point u metres along and v metres across street `line`.
  for (int along_y = 0; along_y < 2; ++along_y) {
    for (int line = 0; line <= kBlocks; ++line) {
      const float offset = static_cast<float>(line) * kBlock_m;
      auto at = [&](float u, float v) { return along_y ? Vec3{offset - v, u, 0} : Vec3{u, offset + v, 0}; };
      for (int block = 0; block < kBlocks; ++block) {
        const float begin = static_cast<float>(block) * kBlock_m + kHalfRoad_m + 2;
        const float end = static_cast<float>(block + 1) * kBlock_m - kHalfRoad_m - 2;
        add_polyline(&geometry, {at(begin, 0.1f), at(end, 0.1f)}, 0.15f, StripKind::lane_mark);
        add_polyline(&geometry, {at(begin, -0.1f), at(end, -0.1f)}, 0.15f, StripKind::lane_mark);
        for (float dash = begin; dash + 3 < end; dash += 9) {
          for (const float v : {-3.5f, 3.5f}) {
            add_polyline(&geometry, {at(dash, v), at(dash + 3, v)}, 0.15f, StripKind::lane_mark);
          }
        }
        for (const float v : {-kHalfRoad_m, kHalfRoad_m}) {
          const float bend = v > 0 ? 2.0f : -2.0f;
          add_polyline(&geometry,
                       {at(begin - 2, v + bend), at(begin - 0.5f, v + 0.2f * bend), at(begin, v), at(end, v),
                        at(end + 0.5f, v + 0.2f * bend), at(end + 2, v + bend)},
                       0.2f, StripKind::road_edge);
        }
        add_polyline(&geometry, {at(end - 3, -kHalfRoad_m + 0.3f), at(end - 3, -0.3f)}, 0.4f, StripKind::stop_line);
        for (const float u : {end - 1.5f, end + 1.5f}) {
          add_polyline(&geometry, {at(u, -kHalfRoad_m), at(u, kHalfRoad_m)}, 0.3f, StripKind::crosswalk);
        }
        // A light head on the far side of the crossing, for traffic in the direction +u.
        LightHead head;
        head.position_m = at(end + 2 * kHalfRoad_m + 6, -kHalfRoad_m - 1);
        head.position_m.z = 5;
        head.facing = along_y ? Vec2{0, -1} : Vec2{-1, 0};
        head.signal = geometry.num_signals++;
        geometry.heads.push_back(head);
        town.scene.light_states.push_back(static_cast<LightState>(random() % kNumLightStates));
        // Houses on one side of the sidewalk, with gaps.
        for (float u = begin + 4; u + 8 < end; u += 12) {
          if (random() % 4 == 0) continue;
          const float v = kHalfRoad_m + 4;
          WallFace wall;
          wall.a_m = at(u, v);
          wall.b_m = at(u + uniform(6, 11), v);
          wall.height_m = uniform(3, 9);
          geometry.walls.push_back(wall);
        }
      }
    }
  }
  geometry.build_grids();

  for (int tries = 0; static_cast<int>(town.scene.agents.size()) < num_agents && tries < 100 * num_agents; ++tries) {
    const bool along_y = random() % 2;
    const float offset = static_cast<float>(random() % (kBlocks + 1)) * kBlock_m;
    const float u = uniform(0, kBlocks * kBlock_m);
    const uint64_t draw = random() % 10;
    const bool back = random() % 2;
    AgentClass agent_class = AgentClass::vehicle;
    Vec3 size{uniform(3.8f, 5.2f), uniform(1.7f, 2.1f), uniform(1.4f, 2.2f)};
    float v = (random() % 2 ? 1.75f : 5.25f) * (back ? 1.0f : -1.0f) + uniform(-0.3f, 0.3f);
    if (draw == 0) {
      agent_class = AgentClass::pedestrian;
      size = {0.6f, 0.6f, uniform(1.5f, 1.9f)};
      v = (back ? 1.0f : -1.0f) * (kHalfRoad_m + 2);
    } else if (draw == 1) {
      agent_class = AgentClass::cyclist;
      size = {1.8f, 0.6f, 1.7f};
    }
    const float heading = (along_y ? kHalfPi : 0.0f) + (back ? kPi : 0.0f) + uniform(-0.15f, 0.15f);
    const AgentBox box =
        make_box(agent_class, along_y ? Vec3{offset - v, u, 0} : Vec3{u, offset + v, 0}, heading, size);
    bool free = true;
    for (const AgentBox& other : town.scene.agents) free = free && apart(box, other);
    if (free) town.scene.agents.push_back(box);
  }
  for (std::size_t i = 0; i < town.scene.agents.size(); ++i) {
    const AgentBox& box = town.scene.agents[i];
    if (box.agent_class != AgentClass::vehicle) continue;
    View view;
    view.ego_agent = static_cast<int32_t>(i);
    view.cos_heading = box.cos_heading;
    view.sin_heading = box.sin_heading;
    view.body_length_m = box.length_m;
    const float rear_axle_m = -0.3f * box.length_m;
    view.origin_m = box.center_m + Vec3{rear_axle_m * box.cos_heading, rear_axle_m * box.sin_heading, 0};
    town.views.push_back(view);
  }
  town.scene.end_world(0);
  return town;
}

Snapshot make_crowd() {
  Snapshot town = make_synthetic_town(3, 0);
  town.scene = {};
  for (int i = 0; i < 900; ++i) {
    const float x = 10 + 1.5f * static_cast<float>(i % 45), y = 1.5f * static_cast<float>(i / 45) - 15;
    town.scene.agents.push_back(
        make_box(AgentClass::pedestrian, {x, y, 0}, 0.1f * static_cast<float>(i), {0.6f, 0.6f, 1.2f}));
  }
  town.scene.light_states.assign(town.geometry.num_signals, LightState::red);
  town.scene.end_world(0);
  town.views = {make_view({0, 0, 6}, 0.05f), make_view({80, 3, 0}, kPi)};
  return town;
}

SyntheticWorlds make_synthetic_worlds() {
  Snapshot towns[] = {make_synthetic_town(11, 50), make_synthetic_town(12, 30)};
  SyntheticWorlds worlds;
  for (Snapshot& town : towns) worlds.maps.push_back(town.geometry);
  SceneOwner& scene = worlds.scene;
  auto add_world = [&](int map, bool has_lights) {
    const Snapshot& town = towns[map];
    const auto world = static_cast<int32_t>(scene.geometry.size()), first = static_cast<int32_t>(scene.agents.size());
    scene.agents.insert(scene.agents.end(), town.scene.agents.begin(), town.scene.agents.end());
    if (has_lights) {
      const std::vector<LightState>& states = town.scene.light_states;
      scene.light_states.insert(scene.light_states.end(), states.begin(), states.end());
    }
    scene.end_world(map);
    for (std::size_t i = 0; i < 3; ++i) {
      View view = town.views[i];
      view.world = world;
      view.ego_agent += first;
      view.hidden_begin = static_cast<int32_t>(scene.hidden_agents.size());
      for (std::size_t other = 0; other < town.views.size(); ++other) {
        if (other % 3 == i) scene.hidden_agents.push_back(first + town.views[other].ego_agent);
      }
      view.hidden_end = static_cast<int32_t>(scene.hidden_agents.size());
      worlds.views.push_back(view);
    }
  };
  add_world(1, true);
  scene.light_states.resize(scene.light_states.size() + towns[0].scene.light_states.size(), LightState::green);
  scene.end_world(0);
  worlds.views.push_back(towns[0].views[0]);
  worlds.views.back().world = 1;
  worlds.views.back().ego_agent = -1;
  add_world(0, true);
  add_world(1, false);
  return worlds;
}

Snapshot make_bridge() {
  Snapshot bridge;
  for (const float y : {-3.5f, 0.0f, 3.5f}) {
    add_polyline(&bridge.geometry, {{-20, y, 0}, {110, y, 0}}, 0.15f, StripKind::lane_mark);
  }
  for (const float x : {30.0f, 33.5f, 37.0f}) {
    add_polyline(&bridge.geometry, {{x, -60, 6}, {x, 60, 6}}, 0.2f, StripKind::road_edge);
  }
  bridge.geometry.build_grids();
  for (int i = 0; i < 5; ++i) {
    const float at = static_cast<float>(i);
    bridge.scene.agents.push_back(make_box(AgentClass::vehicle, {12 + 14 * at, 1.8f, 0}, 0.02f, {4.2f, 1.8f, 1.5f}));
    bridge.scene.agents.push_back(make_box(AgentClass::vehicle, {31.7f, -20 + 9 * at, 6}, kHalfPi, {4.2f, 1.8f, 1.5f}));
  }
  bridge.scene.end_world(0);
  bridge.views = {make_view({-2, -1.8f, 0}, 0), make_view({35.2f, -12, 6}, 1.2f), make_view({5, 0, 14}, 0.1f)};
  return bridge;
}

Snapshot make_hill() {
  Snapshot hill;
  auto road = [](float x, float y) { return Vec3{x, y, x < 10 ? 0.0f : 0.12f * (x - 10)}; };
  for (const float y : {-3.5f, 0.0f, 3.5f}) {
    add_polyline(&hill.geometry, {road(-20, y), road(10, y), road(40, y), road(80, y)}, 0.15f, StripKind::lane_mark);
  }
  for (const float y : {-7.0f, 7.0f}) {
    add_polyline(&hill.geometry, {road(-20, y), road(10, y), road(40, y), road(80, y)}, 0.2f, StripKind::road_edge);
  }
  add_polyline(&hill.geometry, {road(30, -7), road(30, 0)}, 0.4f, StripKind::stop_line);
  for (const float x : {44.0f, 48.0f}) {
    add_polyline(&hill.geometry, {{x, -40, 9.5f}, {x, 40, 9.5f}}, 0.2f, StripKind::road_edge);
  }
  for (int i = 0; i < 5; ++i) {
    WallFace wall;
    wall.a_m = road(12 + 12 * static_cast<float>(i), 11);
    wall.b_m = road(20 + 12 * static_cast<float>(i), 12);
    wall.height_m = 6;
    hill.geometry.walls.push_back(wall);
  }
  for (const float facing : {-1.0f, 1.0f}) {
    LightHead head;
    head.position_m = road(34, 8.5f * facing) + Vec3{0, 0, 5};
    head.facing = {facing, 0};
    head.signal = hill.geometry.num_signals++;
    hill.geometry.heads.push_back(head);
    hill.scene.light_states.push_back(LightState::red);
  }
  hill.geometry.build_grids();
  for (int i = 0; i < 7; ++i) {
    const float x = 7 + 9 * static_cast<float>(i), y = i % 2 ? 1.8f : -1.8f;
    hill.scene.agents.push_back(
        make_box(AgentClass::vehicle, road(x, y), 0.1f * static_cast<float>(i), {4.4f, 1.9f, 1.5f}));
    hill.scene.agents.push_back(make_box(AgentClass::pedestrian, road(x + 3, 8.5f), 0, {0.6f, 0.6f, 1.75f}));
    hill.scene.agents.push_back(make_box(AgentClass::cyclist, road(x + 2, -5.5f), 0, {1.8f, 0.6f, 1.7f}));
  }
  hill.scene.end_world(0);
  hill.views = {make_view(road(-6, -1.8f), 0.05f), make_view(road(60, 0), kPi), make_view({46, -12, 9.5f}, 1.8f)};
  return hill;
}

Snapshot make_crash() {
  Snapshot crash;
  crash.scene.agents = {make_box(AgentClass::vehicle, {11, 0.5f, 0}, 0.3f, {4.4f, 1.9f, 1.5f}),
                        make_box(AgentClass::vehicle, {13, -0.6f, 0}, 1.4f, {4.6f, 2.0f, 1.7f}),
                        make_box(AgentClass::cyclist, {8, 1.5f, 0}, 0.9f, {1.8f, 0.6f, 1.7f}),
                        make_box(AgentClass::vehicle, {9, 2.2f, 0}, -0.4f, {4.4f, 1.9f, 1.5f})};
  crash.scene.end_world(0);
  WallFace wall;
  wall.a_m = {10, 3, 0};
  wall.b_m = {16, -9, 0};
  wall.height_m = 3;
  crash.geometry.walls.push_back(wall);
  crash.geometry.build_grids();
  crash.views = {make_view({}, 0), make_view({22, 5, 0}, 3.6f)};
  return crash;
}

Rig simple_rig(int width_px, int height_px, float focal_px) {
  Camera camera;
  camera.name = "simple";
  camera.width_px = width_px;
  camera.height_px = height_px;
  camera.focal_x_px = camera.focal_y_px = focal_px;
  camera.center_x_px = 0.5f * static_cast<float>(width_px);
  camera.center_y_px = 0.5f * static_cast<float>(height_px);
  camera.position_m = {0, 0, 1.5f};
  return {{camera}};
}

Rig front_rig(int width_px, int height_px) {
  Rig rig = paper_rig(width_px, height_px);
  rig.cameras.resize(1);
  return rig;
}

Rig mixed_rig() {
  Rig rig = paper_rig(97, 55);
  rig.cameras[1] = paper_rig(1, 1).cameras[1];
  rig.cameras[2] = paper_rig(40, 130).cameras[2];
  return rig;
}

Rig eight_camera_rig() {
  Rig eight;
  const int widths[] = {96, 64, 33, 128, 17, 50, 80, 7}, heights[] = {54, 36, 71, 20, 90, 50, 31, 5};
  for (int i = 0; i < 8; ++i) {
    Camera camera = paper_rig(widths[i], heights[i]).cameras[i % 4];
    camera.name = std::to_string(i);
    camera.pitch_rad = 0.05f * static_cast<float>(i - 4);
    camera.roll_rad = 0.04f * static_cast<float>(4 - i);
    eight.cameras.push_back(camera);
  }
  return eight;
}

std::vector<HardScene> hard_scenes() {
  return {{"hill", make_hill(), paper_rig()},
          {"hill_of_odd_size", make_hill(), paper_rig(97, 55)},
          {"hill_in_one_pixel", make_hill(), paper_rig(1, 1)},
          {"hill_by_eight_cameras", make_hill(), eight_camera_rig()},
          {"bridge", make_bridge(), paper_rig()},
          {"crash", make_crash(), paper_rig()}};
}

namespace {
Outputs draw_outputs(Renderer* renderer, const SceneOwner& scene, const std::vector<View>& views, Planes planes) {
  const Rig& rig = renderer->config().rig;
  const int num_views = static_cast<int>(views.size());
  HostImages images(rig, num_views, PixelFormat::f32, planes);
  renderer->render(scene.batch(), views, images.batch());
  Outputs out;
  auto append = [](auto* to, const auto* from, std::size_t count) { to->insert(to->end(), from, from + count); };
  for (std::size_t k = 0; k < rig.cameras.size(); ++k) {
    const CameraImages& camera = images.camera(static_cast<int>(k));
    const auto pixels = static_cast<std::size_t>(camera.width_px * camera.height_px);
    for (int view = 0; view < num_views; ++view) {
      append(&out.color, static_cast<const float*>(camera.data) + view * camera.view_stride, 3 * pixels);
    }
    if (planes == Planes::none) continue;
    append(&out.depth_m, camera.depth_m, pixels * views.size());
    append(&out.class_id, camera.class_id, pixels * views.size());
    append(&out.instance_id, camera.instance_id, pixels * views.size());
  }
  return out;
}
}  // namespace

Outputs draw_outputs(Renderer* renderer, const Snapshot& town, Planes planes) {
  renderer->upload(0, town.geometry);
  return draw_outputs(renderer, town.scene, town.views, planes);
}

Outputs draw_outputs(Renderer* renderer, const SyntheticWorlds& worlds, Planes planes) {
  upload_geometries(worlds.maps, renderer);
  return draw_outputs(renderer, worlds.scene, worlds.views, planes);
}

}  // namespace pictura
