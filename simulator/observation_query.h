// Observations of what is not there: what Simulator::observe is asked. Plain structs that both devices read.
#pragma once

#include "pictura/common/scene_types.h"
#include "pictura/simulator/observation.h"

namespace pictura {

/// The observation of a slot as it would be if some boxes were not there, and others were.
struct ObservationQuery {
  int32_t slot = 0;
  int32_t hidden_begin = 0, hidden_end = 0;      // who is left out: a range of a list of indices into scene().agents
  int32_t inserted_begin = 0, inserted_end = 0;  // who comes in: a range of a list of InsertedBoxes
  /// 0: the partners are those of a world without the hidden boxes: who was too far to be among them comes in. 1: they
  /// are counted and ordered with the hidden ones, whose rows are zeros.
  int32_t leaves_gaps = 0;
};

/// A box that stands in no scene. It is not met if it is not `drawn`.
struct InsertedBox {
  AgentBox box;
  float speed_mps = 0;  // signed, for the auxiliary slot
};

/// Queries with the lists that they point into, and what is to be written for them: a row each, of the parts that the
/// simulator observes.
struct ObservationQueries {
  Span<const ObservationQuery> queries;
  Span<const int32_t> hidden;
  Span<const InsertedBox> inserted;
  ObservationView out;
};

}  // namespace pictura
