// Input of Simulator::observe(), which computes hypothetical observations. Plain structs for host and device code.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// Question: what would a slot observe if some boxes were hidden and some boxes were inserted?
struct ObservationQuery {
  int32_t slot = 0;
  int32_t hidden_begin = 0, hidden_end = 0;      // hidden boxes: a range of a list of indices into scene().agents
  int32_t inserted_begin = 0, inserted_end = 0;  // inserted boxes: a range of a list of InsertedBoxes
  /// 0: hidden boxes are ignored, so that farther boxes take their rows among the partners (the observed road users).
  /// 1: hidden boxes keep their rows, which are zeros.
  int32_t leaves_gaps = 0;
};

/// A hypothetical box. It is ignored if box.drawn is 0.
struct InsertedBox {
  AgentBox box;
  float speed_mps = 0;  // signed, along the heading; observed as an auxiliary feature
};

/// Queries, the lists to which they refer, and the output. Each array of `out` has one row per query; arrays that the
/// simulator does not fill are empty.
struct ObservationQueries {
  Span<const ObservationQuery> queries;
  Span<const int32_t> hidden;
  Span<const InsertedBox> inserted;
  ObservationView out;
};

}  // namespace pictura
