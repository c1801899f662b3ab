// Worlds and results of a simulator on the host.
#pragma once

#include <vector>

#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/simulator_state.h"

namespace pictura {

struct HostWorlds {
  explicit HostWorlds(SimulatorSetup its_setup);
  HostWorlds(const HostWorlds&) = delete;
  HostWorlds& operator=(const HostWorlds&) = delete;
  /// Replaces the worlds by those of another setup, in their initial state. The state's arrays are reallocated only if
  /// their capacity is too small.
  void assign(const SimulatorSetup& other);
  void reserve(const SimulatorCapacity& capacity);

  WorldView world(int index);

  SimulatorSetup setup;
  SimulatorState state;
  // Boxes by the cells of their centres.
  std::vector<CellLists> box_cells;  // [worlds]
  std::vector<Vec2> cell_centers;    // in the order of box_cells
  SceneBatch scene;

 private:
  void make_cells_and_scene();
};

/// Outputs besides the state.
struct HostResults {
  HostResults() = default;
  HostResults(size_t num_slots, const SimulatorConfig& config) { resize(num_slots, config); }
  void resize(size_t num_slots, const SimulatorConfig& config);
  void reserve(size_t num_slots, const SimulatorConfig& config);
  ObservationView observation_view();
  StepArrays step_arrays() {
    return {.reward = reward.data(),
            .terminated = terminated.data(),
            .truncated = truncated.data(),
            .valid = valid.data(),
            .sums = sums.data()};
  }

  std::vector<float> reward;  // [slots], like all vectors below
  std::vector<uint8_t> terminated, truncated, valid, driver;
  std::vector<StepSums> sums;
  std::vector<View> views;

 private:
#define X(name, type, rows, features, part, comment) std::vector<type> name##_;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

}  // namespace pictura
