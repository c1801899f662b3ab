// Constants of the module: names and layouts of arrays, fields, events and structs.
#include "pictura/bindings/python_simulator.h"

namespace pictura::python {

void bind_names(py::module_& module) {
  py::list fields;
  for (size_t i = 0; i < std::size(kAgentFields); ++i) {
    const AgentFieldInfo& info = kAgentFields[i];
    fields.append(py::make_tuple(std::string(info.name), std::string(name_of(info.type)), info.per_agent,
                                 is_derived(static_cast<AgentField>(i)), std::string(info.comment)));
  }
  module.attr("AGENT_FIELDS") = py::tuple(fields);
  py::list observations;
  for (const ObservationArray& array : kObservationArrays) {
    observations.append(
        py::make_tuple(std::string(array.name), std::string(name_of(array.type)), array.rows, array.features));
  }
  module.attr("OBSERVATION_ARRAYS") = py::tuple(observations);
  module.attr("CONDITIONING_NAMES") =
      py::tuple(py::cast(std::vector<std::string>(std::begin(kConditioningNames), std::end(kConditioningNames))));
  std::vector<std::string> terms;
#define X(name) terms.emplace_back(#name);
  PICTURA_REWARD_TERMS(X)
#undef X
  module.attr("REWARD_TERMS") = py::tuple(py::cast(terms));
  module.attr("NUM_ACTIONS") = kNumActions;
  module.attr("IDLE_ACTION") = kIdleAction;
  py::list command;
  for (const char* name : {"kind", "action"}) command.append(py::make_tuple(name, "<i4"));
  for (const char* name : {"x_m", "y_m", "z_m", "heading_rad", "speed_mps"})
    command.append(py::make_tuple(name, "<f4"));
  // `members` are in the format of NumPy's dtype().
  const auto dtype_of = [](const py::list& members, size_t size, const char* what) {
    const py::object type = py::module_::import("numpy").attr("dtype")(members);
    PICTURA_CHECK(py::cast<size_t>(type.attr("itemsize")) == size, "{}'s layout", what);
    return type;
  };
  py::list query;
  for (const char* name : {"slot", "hidden_begin", "hidden_end", "inserted_begin", "inserted_end", "leaves_gaps"}) {
    query.append(py::make_tuple(name, "<i4"));
  }
  module.attr("COMMAND_DTYPE") = dtype_of(command, sizeof(Command), "a command");
  module.attr("QUERY_DTYPE") = dtype_of(query, sizeof(ObservationQuery), "a query");
  py::list inserted;
  inserted.append(py::make_tuple("box", module.attr("BOX_DTYPE")));
  inserted.append(py::make_tuple("speed_mps", "<f4"));
  module.attr("INSERTED_DTYPE") = dtype_of(inserted, sizeof(InsertedBox), "an inserted box");
  py::dict events;
  events["collision"] = static_cast<int>(kEventCollision);
  events["at_fault"] = static_cast<int>(kEventAtFault);
  events["off_road"] = static_cast<int>(kEventOffRoad);
  events["red_light"] = static_cast<int>(kEventRedLight);
  events["wall"] = static_cast<int>(kEventWall);
  events["goal"] = static_cast<int>(kEventGoal);
  events["waypoint"] = static_cast<int>(kEventWaypoint);
  events["metric_goal"] = static_cast<int>(kEventMetricGoal);
  module.attr("EVENTS") = events;
  module.attr("INFRACTIONS") = kInfractions;
  py::dict event_totals;
#define X(name, logged, counted) event_totals[#name] = static_cast<int>(counted);
  PICTURA_EVENT_TOTALS(X)
#undef X
  module.attr("EVENT_TOTALS") = event_totals;
}

}  // namespace pictura::python
