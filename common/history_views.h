// Stored views of a SceneHistory, for host and CUDA code. at() returns a stored view with indices into
// SceneHistory::scene().
#pragma once

#include "pictura/common/scene_types.h"

namespace pictura {

struct HistoryViews {
  const View* views = nullptr;  // [num_steps, views_per_step], as passed to put()
  int64_t views_per_step = 0;
  int32_t num_steps = 0, worlds_per_step = 0, agents_per_step = 0;

  PICTURA_HD View at(int64_t row) const {
    View nowhere;
    nowhere.world = -1;
    if (row < 0 || row >= num_steps * views_per_step) return nowhere;
    View view = views[row];
    // Indices are checked before the shift, because a shifted index could refer to another step.
    if (view.world < 0 || view.world >= worlds_per_step || view.ego_agent >= agents_per_step) return nowhere;
    const auto step = static_cast<int32_t>(row / views_per_step);
    view.world += step * worlds_per_step;
    if (view.ego_agent >= 0) view.ego_agent += step * agents_per_step;
    return view;
  }
};

}  // namespace pictura
