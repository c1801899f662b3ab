// Random observation queries, and memory for their answers.
#pragma once

#include <algorithm>
#include <limits>
#include <vector>

#include "pictura/common/rng.h"
#include "pictura/simulator/host_worlds.h"
#include "pictura/simulator/simulator.h"

namespace pictura::testing {

/// Random queries, for a simulator on the host. number: selects the random numbers. A query hides up to half of its
/// world's boxes, and inserts up to three boxes.
struct RandomQueries {
  RandomQueries(Simulator* simulator, int count, uint32_t number) {
    const SceneBatch& scene = simulator->scene();
    for (int i = 0; i < count; ++i) {
      RandomStream random({.seed = 11, .world = number, .agent = static_cast<uint32_t>(i), .purpose = Purpose::action});
      ObservationQuery query;
      query.slot = random.below(simulator->num_slots());
      const View& view = simulator->views()[query.slot];
      const auto world = static_cast<size_t>(view.world);
      const int32_t first_box = scene.world_begin[world], num_boxes = scene.world_begin[world + 1] - first_box;
      query.hidden_begin = static_cast<int32_t>(hidden.size());
      const int num_hidden = random.below(3) == 0 ? 0 : random.below(1 + num_boxes / 2);
      for (int k = 0; k < num_hidden; ++k) hidden.push_back(first_box + random.below(num_boxes));
      query.hidden_end = static_cast<int32_t>(hidden.size());
      query.inserted_begin = static_cast<int32_t>(inserted.size());
      const int num_inserted = random.below(4);
      for (int k = 0; k < num_inserted; ++k) {
        InsertedBox one;
        one.box = scene.agents[first_box + random.below(num_boxes)];
        one.box.center_m = view.origin_m + Vec3{random.uniform(-80, 80), random.uniform(-80, 80), 0};
        one.box.drawn = random.below(5) > 0;
        one.box.length_m = random.uniform(1, 6);
        one.speed_mps = random.uniform(-2, 20);
        inserted.push_back(one);
      }
      query.inserted_end = static_cast<int32_t>(inserted.size());
      query.leaves_gaps = random.below(2);
      queries.push_back(query);
    }
  }
  ObservationQueries asked(const ObservationView& out) const { return {queries, hidden, inserted, out}; }

  std::vector<ObservationQuery> queries;
  std::vector<int32_t> hidden;
  std::vector<InsertedBox> inserted;
};

class AnswerMemory {
 public:
  AnswerMemory(size_t count, const SimulatorConfig& config)
      : memory_(count, config){
#define X(name, type, rows, features, part, comment) \
  std::fill(view().name.begin(), view().name.end(), std::numeric_limits<type>::max());
            PICTURA_OBSERVATION_ARRAYS(X)
#undef X
        } ObservationView view() {
    return memory_.observation_view();
  }

 private:
  HostResults memory_;
};

inline ObservationView observation_of(const ObservationView& all, size_t row) {
  ObservationView one;
#define X(name, type, rows, features, part, comment) \
  if (!all.name.empty()) one.name = all.name.subspan(row * (rows) * (features), size_t{(rows) * (features)});
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  return one;
}

}  // namespace pictura::testing
