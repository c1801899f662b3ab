// Input of Simulator::observe(), for host and device code.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// Question: what would a slot observe if some boxes were hidden and others inserted?
struct ObservationQuery {
  int32_t slot = 0;
  int32_t hidden_begin = 0, hidden_end = 0;      // range of ObservationQueries::hidden
  int32_t inserted_begin = 0, inserted_end = 0;  // range of ObservationQueries::inserted
  /// 0: hidden boxes get no row among the partners (observed road users); farther boxes move up. 1: the rows of hidden
  /// boxes are zeros.
  int32_t leaves_gaps = 0;
};

/// Hypothetical box, which is ignored if box.drawn is 0.
struct InsertedBox {
  AgentBox box;
  float speed_mps = 0;  // signed, along the heading; auxiliary feature
};

/// `hidden` contains indices into scene().agents. Each array of `out` has one row per query, or is empty if not
/// computed.
struct ObservationQueries {
  Span<const ObservationQuery> queries;
  Span<const int32_t> hidden;
  Span<const InsertedBox> inserted;
  ObservationView out;
};

}  // namespace pictura
