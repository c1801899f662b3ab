// Python functions whose arguments are the options that visit_options() lists.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <optional>
#include <string>
#include <type_traits>
#include <utility>
#include <variant>
#include <vector>

#include <pybind11/pybind11.h>
#include <pybind11/stl.h>

#include "pictura/bindings/function_controller.h"
#include "pictura/common/array.h"
#include "pictura/common/span.h"
#include "pictura/common/support/named_option.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/simulator/conditioning.h"

namespace pictura::python {

namespace py = pybind11;

/// Throws UsageError for names other than "cpu", "cuda", "cuda:1", ...
Device device_of(const std::string& name);

using ConditioningRanges = std::array<ConditioningRange, kNumConditioning>;

/// Option as a parameter of a Python function.
struct Parameter {
  std::string name;
  py::object value;      // current value
  py::cpp_function set;  // set(value) converts a Python value and stores it
  std::string integers;  // range of an integer's C++ type, which conversions check; empty for other types
};

/// Collects options as parameters. The visited struct must outlive them.
class ParameterVisitor {
 public:
  /// function: name in messages.
  explicit ParameterVisitor(std::string function) : function_(std::move(function)) {}

  /// The range is checked where the number is used.
  template <typename T, typename... Range>
  void value(const NamedOption& option, T& value, Range...) {
    add<T>(option, value, [&value](const T& given) { value = given; });
  }
  void name(const NamedOption& option, std::string& text, const std::vector<std::string>&) { value(option, text); }
  template <typename Enum>
  void choice(const NamedOption& option, Enum& value, Span<const char* const> names) {
    add<std::string>(option, names[static_cast<int>(value)],
                     [=, &value](const std::string& given) { value = chosen<Enum>(option, given, names); });
  }
  /// An empty name means nullopt.
  template <typename Enum>
  void choice(const NamedOption& option, std::optional<Enum>& value, Span<const char* const> names) {
    add<std::string>(option, value ? names[static_cast<int>(*value)] : "", [=, &value](const std::string& given) {
      value = given.empty() ? std::nullopt : std::optional(chosen<Enum>(option, given, names));
    });
  }
  template <typename Enum>
  void choice(const NamedOption& option, std::vector<Enum>& values, Span<const char* const> names) {
    std::vector<std::string> texts;
    for (const Enum value : values) texts.emplace_back(names[static_cast<int>(value)]);
    add<std::vector<std::string>>(option, texts, [=, &values](const std::vector<std::string>& given) {
      values.clear();
      for (const std::string& name : given) values.push_back(chosen<Enum>(option, name, names));
    });
  }
  void device(const NamedOption& option, Device& value);
  /// Adds map names, with ranges of seeds expanded.
  void maps(const NamedOption& option, std::vector<std::string>& names);
  /// Adds a dict from coefficients to their ranges: a number or (low, high).
  void conditioning(const NamedOption& option, ConditioningRanges& ranges);
  /// Adds a dict, stored as texts "name=value".
  void numbers_by_name(const NamedOption& option, std::vector<std::string>& texts);
  /// Adds a controller's name, or a Python function that chooses actions.
  template <typename Options>
  void controller(const NamedOption& option, Options& options) {
    using Given = std::variant<std::string, py::function>;
    add<Given>(option, Given(options.controller), [&options](const Given& given) {
      options.make_own_controller = nullptr;
      if (const auto* const name = std::get_if<std::string>(&given)) {
        options.controller = *name;
      } else {
        options.controller = name_of_function(std::get<py::function>(given));
        options.make_own_controller = function_controllers(std::get<py::function>(given));
      }
    });
  }
  template <typename Options>
  void policies(const NamedOption& option, Options& options) {
    using Given = std::vector<std::variant<std::string, py::function>>;
    add<Given>(option, {}, [&options](const Given& given) {
      for (const auto& one : given) {
        const auto* const path = std::get_if<std::string>(&one);
        options.policies.push_back(path ? *path : name_of_function(std::get<py::function>(one)));
        options.make_own_policies.push_back(path ? nullptr : function_sessions(std::get<py::function>(one)));
      }
    });
  }
  /// Adds a Python function or None.
  template <typename... Arguments>
  void callback(const NamedOption& option, std::function<void(Arguments...)>& value) {
    add<py::object>(option, py::none(), [&value](const py::object& given) {
      if (given.is_none()) return;
      // Shared, because options are copied without the GIL.
      value = [function = std::make_shared<const py::object>(given)](Arguments... arguments) {
        const py::gil_scoped_acquire gil;
        (*function)(arguments...);
      };
    });
  }

  const std::vector<Parameter>& parameters() const { return parameters_; }

 private:
  /// Returns the current name of a choice. For its old name, raises DeprecationWarning.
  static std::string current_name(const NamedOption& option, const std::string& name);
  template <typename Enum>
  static Enum chosen(const NamedOption& option, const std::string& name, Span<const char* const> names) {
    return static_cast<Enum>(index_of_word(option.name, current_name(option, name), names));
  }
  template <typename T, typename Set>
  void add(const NamedOption& option, const T& value, const Set& set) {
    const py::arg_v argument = (py::arg(option.name.c_str()) = value);
    parameters_.push_back(
        {option.name,
         argument.value,
         py::cpp_function([set](const T& given) { set(given); }, argument, py::name(function_.c_str())),
         {}});
    if constexpr (std::is_integral_v<T> && !std::is_same_v<T, bool>) {
      using Limits = std::numeric_limits<T>;
      parameters_.back().integers = std::to_string(Limits::min()) + " to " + std::to_string(Limits::max());
    }
  }

  std::string function_;
  std::vector<Parameter> parameters_;
};

/// Returns a signature as pybind11 writes it: "(steps: int = 3) -> str".
std::string signature_of(const py::cpp_function& function);

template <typename Options>
std::vector<Parameter> parameters_of(const std::string& function, Options& options) {
  ParameterVisitor visitor(function);
  visit_options(options, visitor);
  return visitor.parameters();
}

/// Python function whose parameters are a struct's options. Only the options `required` may be positional.
struct OptionsFunction {
  std::string name;
  std::vector<std::string> required;

  /// Returns the text of help(): a signature such as "(config: str, *, minutes: float = 0.0) -> dict", and `doc`.
  /// `first`: parameters before the options.
  template <typename Options>
  std::string help(const std::string& first, const std::string& result, const std::string& doc) const {
    Options defaults;
    return signature(parameters_of(name, defaults), first, result) + "\n\n" + doc;
  }
  /// Returns a callable with the parameters of Options. Throws TypeError for arguments that do not fit.
  template <typename Options, typename Function>
  auto caller(const Function& function) const {
    return [*this, function](const py::args& by_place, const py::kwargs& by_name) {
      Options options;
      read(by_place, by_name, parameters_of(name, options));
      return function(options);
    };
  }

 private:
  std::string signature(const std::vector<Parameter>& parameters, std::string first, const std::string& result) const;
  void read(const py::args& by_place, const py::dict& by_name, const std::vector<Parameter>& parameters) const;
};

/// Defines a function with the parameters of Options.
template <typename Options, typename Function>
void def_with_options(py::module_* module, const OptionsFunction& arguments, const Function& function,
                      const std::string& doc) {
  const std::string result = signature_of(py::cpp_function([] { return std::invoke_result_t<Function, Options&>(); }));
  const std::string help = arguments.name + arguments.help<Options>("", result.substr(sizeof("() ->")), doc);
  py::options without_signature;
  without_signature.disable_function_signatures();
  module->def(arguments.name.c_str(), arguments.caller<Options>(function), help.c_str());
}

/// Defines a constructor with the parameters of Options. arguments.name: the class's name.
template <typename Options, typename Class, typename Function>
void def_init_with_options(Class* its_class, const OptionsFunction& arguments, const Function& make,
                           const std::string& doc) {
  const std::string self = "self: " + py::cast<std::string>(its_class->attr("__module__")) + "." + arguments.name;
  const std::string help = "__init__" + arguments.help<Options>(self, "None", doc);
  py::options without_signature;
  without_signature.disable_function_signatures();
  its_class->def(py::init(arguments.caller<Options>(make)), help.c_str());
}

}  // namespace pictura::python
