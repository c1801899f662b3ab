// Hypothetical observations: the input of Simulator::observe. Plain structs that both devices read.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// Query for the observation of a slot without some boxes and with some additional boxes.
struct ObservationQuery {
  int32_t slot = 0;
  int32_t hidden_begin = 0, hidden_end = 0;      // hidden boxes: a range of a list of indices into scene().agents
  int32_t inserted_begin = 0, inserted_end = 0;  // inserted boxes: a range of a list of InsertedBoxes
  /// 0: partners are chosen as in a world without the hidden boxes, so that farther boxes take their rows. 1: partners
  /// are chosen with the hidden boxes, whose rows are zeros.
  int32_t leaves_gaps = 0;
};

/// A box that is in no scene. It is ignored unless `drawn`.
struct InsertedBox {
  AgentBox box;
  float speed_mps = 0;  // signed, for the auxiliary slot
};

/// Queries, the lists that they refer to, and the output: one row per query, of the parts that the simulator observes.
struct ObservationQueries {
  Span<const ObservationQuery> queries;
  Span<const int32_t> hidden;
  Span<const InsertedBox> inserted;
  ObservationView out;
};

}  // namespace pictura
