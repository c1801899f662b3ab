#include "pictura/simulator/host_worlds.h"

#include <utility>

namespace pictura {
namespace {

CellLists empty_box_cells(const MapRules& map, size_t num_boxes) {
  CellLists cells;
  cells.origin_m = map.low_m;
  cells.cell_m = kBoxCell_m;
  const BoxCellCounts counts = count_box_cells(map);
  cells.num_x = static_cast<int>(counts.num_x);
  cells.num_y = static_cast<int>(counts.num_y);
  cells.begin.assign(static_cast<size_t>(counts.num_x * counts.num_y) + 1, 0);
  cells.items.assign(num_boxes, 0);
  return cells;
}

}  // namespace

HostWorlds::HostWorlds(SimulatorSetup its_setup) : setup(std::move(its_setup)), state(setup) { make_cells_and_scene(); }

void HostWorlds::assign(const SimulatorSetup& other) {
  setup = other;  // copied, so that arrays keep their memory
  state.resize(setup);
  make_cells_and_scene();
}

void HostWorlds::reserve(const SimulatorCapacity& capacity) {
  setup.reserve(capacity);
  state.reserve(capacity, setup.config);
  cell_centers.reserve(capacity.boxes(setup.config));
  make_cells_and_scene();
}

void HostWorlds::make_cells_and_scene() {
  box_cells.clear();
  for (int w = 0; w < setup.num_worlds(); ++w) {
    const auto index = static_cast<size_t>(w);
    box_cells.push_back(empty_box_cells(setup.map_of(w).rules,
                                        static_cast<size_t>(setup.box_begin[index + 1] - setup.box_begin[index])));
  }
  cell_centers.assign(setup.num_boxes(), {});
  scene.world_begin = setup.box_begin;
  scene.agents = state.boxes;
  scene.geometry = setup.geometry;
  scene.light_begin = setup.light_begin;
  scene.light_states = state.lights;
}

WorldView HostWorlds::world(int index) {
  const auto w = static_cast<size_t>(index);
  const int32_t first_box = setup.box_begin[w], first_light = setup.light_begin[w];
  WorldView view = setup.view(index, setup.map_views[setup.worlds[w].map], setup.options);
  view.seed = state.seed[w];
  view.episode = static_cast<uint32_t>(state.episode_index[w]);
  view.step = state.episode_step[w];
  view.agents = state.agents.view();
  view.boxes = state.boxes.data() + first_box;
  view.boxes_before = state.boxes_before.data() + first_box;
  view.box_cells = box_cells[w].view();
  view.cell_centers = cell_centers.data() + first_box;
  view.light_plans = state.light_plans.data() + first_light;
  view.lights = state.lights.data() + first_light;
  return view;
}

void HostResults::resize(size_t num_slots, const SimulatorConfig& config) {
  reward.assign(num_slots, 0);
  for (auto* flags : {&terminated, &truncated, &valid, &driver}) flags->assign(num_slots, 0);
  sums.assign(num_slots, {});
  views.assign(num_slots, {});
#define X(name, type, rows, features, part, comment) \
  name##_.assign(config.observes(part) ? num_slots*(rows) * (features) : 0, 0);
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
}

void HostResults::reserve(size_t num_slots, const SimulatorConfig& config) {
  reward.reserve(num_slots);
  for (auto* flags : {&terminated, &truncated, &valid, &driver}) flags->reserve(num_slots);
  sums.reserve(num_slots);
  views.reserve(num_slots);
#define X(name, type, rows, features, part, comment) \
  if (config.observes(part)) name##_.reserve(num_slots*(rows) * (features));
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
}

ObservationView HostResults::observation_view() {
#define X(name, type, rows, features, part, comment) .name = name##_,
  return {PICTURA_OBSERVATION_ARRAYS(X)};
#undef X
}

}  // namespace pictura
