#include "pictura/bindings/options.h"

#include <algorithm>

#include <fmt/format.h>

#include "pictura/bindings/arrays.h"
#include "pictura/common/error.h"
#include "pictura/map/map_copy.h"
#include "pictura/simulator/conditioning_lookup.h"

namespace pictura::python {

Device device_of(const std::string& name) {
  if (name == "cpu") return {};
  if (name == "cuda") return {MemorySpace::cuda, 0};
  if (name.rfind("cuda:", 0) == 0 && name.size() > 5 && name.size() < 9 &&
      name.find_first_not_of("0123456789", 5) == std::string::npos) {
    return {MemorySpace::cuda, std::stoi(name.substr(5))};
  }
  fail_usage("device: expected 'cpu', 'cuda' or 'cuda:INDEX', got '{}'", name);
}

void ParameterVisitor::device(const NamedOption& option, Device& value) {
  add<std::string>(option, name_of(value), [&value](const std::string& given) { value = device_of(given); });
}

void ParameterVisitor::maps(const NamedOption& option, std::vector<std::string>& names) {
  add<std::vector<std::string>>(option, names,
                                [&names](const std::vector<std::string>& given) { names = expand_map_names(given); });
}

void ParameterVisitor::conditioning(const NamedOption& option, ConditioningRanges& ranges) {
  add<py::dict>(option, {}, [&ranges](const py::dict& given) {
    for (const auto& [key, value] : given) {
      const auto name = cast_checked<std::string>(key, "conditioning", "names");
      ConditioningRange& range = ranges[conditioning_index(name, "conditioning")];
      if (py::isinstance<py::float_>(value) || py::isinstance<py::int_>(value)) {
        const auto fixed = py::cast<float>(value);
        range = {fixed, fixed, false};
      } else {
        const auto [low, high] =
            cast_checked<std::pair<float, float>>(value, "conditioning: " + name, "a number or (low, high)");
        range.low = low;
        range.high = high;
      }
    }
  });
}

void ParameterVisitor::numbers_by_name(const NamedOption& option, std::vector<std::string>& texts) {
  add<py::dict>(option, {}, [&texts](const py::dict& given) {
    for (const auto& [name, value] : given) {
      texts.push_back(fmt::format("{}={}", py::cast<std::string>(name), py::cast<double>(value)));
    }
  });
}

std::string ParameterVisitor::current_name(const NamedOption& option, const std::string& name) {
  if (!option.renamed.old_name || name != option.renamed.old_name) return name;
  // Where warnings are errors, the call raises.
  if (PyErr_WarnEx(PyExc_DeprecationWarning, option.renamed.warning(option.name).c_str(), 1) != 0) {
    throw py::error_already_set();
  }
  return option.renamed.name;
}

namespace {

/// Stores a value. Throws UsageError for an int that the parameter's type cannot hold, and TypeError for other types.
void set(const Parameter& parameter, const py::object& value) {
  try {
    parameter.set(value);
  } catch (const py::error_already_set& error) {
    if (parameter.integers.empty() || !py::isinstance<py::int_>(value) || !error.matches(PyExc_TypeError)) throw;
    fail_usage("{}: expected {}, got {}", parameter.name, parameter.integers, py::cast<std::string>(py::str(value)));
  }
}

}  // namespace

std::string signature_of(const py::cpp_function& function) {
  const auto text = py::cast<std::string>(function.attr("__doc__"));
  return text.substr(text.find('('), text.find('\n') - text.find('('));
}

std::string OptionsFunction::signature(const std::vector<Parameter>& parameters, std::string first,
                                       const std::string& result) const {
  std::string others;
  for (const Parameter& parameter : parameters) {
    const bool is_required = std::find(required.begin(), required.end(), parameter.name) != required.end();
    const std::string text = signature_of(parameter.set);  // (NAME: TYPE = DEFAULT) -> None
    std::string& list = is_required ? first : others;
    list += (list.empty() ? "" : ", ") + text.substr(1, (is_required ? text.find(" = ") : text.rfind(')')) - 1);
  }
  return fmt::format("({}, *, {}) -> {}", first, others, result);
}

void OptionsFunction::read(const py::args& by_place, const py::dict& by_name,
                           const std::vector<Parameter>& parameters) const {
  const auto throw_error = [this](const std::string& why) { throw py::type_error(fmt::format("{}() {}", name, why)); };
  std::vector<std::string> known;
  for (const Parameter& parameter : parameters) known.push_back(parameter.name);
  for (const auto& [key, value] : by_name) {
    const auto given = py::cast<std::string>(key);
    if (std::find(known.begin(), known.end(), given) != known.end()) continue;
    throw_error(fmt::format("got an unexpected keyword argument '{}'{}", given, suggestion(given, known)));
  }
  if (by_place.size() > required.size()) {
    throw_error(fmt::format("takes {} positional arguments, got {}", required.size(), by_place.size()));
  }
  for (const Parameter& parameter : parameters) {
    const size_t place = std::find(required.begin(), required.end(), parameter.name) - required.begin();
    const bool is_named = by_name.contains(parameter.name), is_placed = place < by_place.size();
    if (is_named && is_placed) throw_error(fmt::format("got two values for '{}'", parameter.name));
    if (is_named) set(parameter, by_name[parameter.name.c_str()]);
    if (is_placed) set(parameter, by_place[place]);
    if (!is_named && !is_placed && place < required.size()) {
      throw_error(fmt::format("is missing the argument '{}'", parameter.name));
    }
  }
}

}  // namespace pictura::python
