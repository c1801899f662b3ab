// Options that a struct lists once: visit_options(options, visitor) calls the visitor with each and its value. Python
// takes its keyword arguments from such a list, commands their flags, configurations their keys.
#pragma once

#include <limits>
#include <string>
#include <utility>

namespace pictura {

/// An option and what is to be said of it beside its type and default.
struct NamedOption {
  std::string name;                                        // in Python
  const char *flag = nullptr, *help = nullptr;             // in commands, where it has one
  double low = 0, high = std::numeric_limits<int>::max();  // what numbers the flag takes
};

/// What a run that goes on may change of a key: nothing; its value, without a word; or its value, with a notice.
enum class Resume { fixed, free, reported };

/// Whether an evaluation counts by a key's value, where its section matters to evaluations at all, or by an option of
/// its own in its place.
enum class Evaluation { counts, replaced };

/// A key of configurations and what is to be said of it beside its type, default and range.
struct NamedKey {
  NamedKey(const char* its_name) : name(its_name) {}                // NOLINT: most keys are a name alone
  NamedKey(std::string its_name, Resume at_resume = Resume::fixed,  // NOLINT
           Evaluation in_evaluation = Evaluation::counts)
      : name(std::move(its_name)), resume(at_resume), evaluation(in_evaluation) {}
  NamedKey(std::string its_name, Evaluation in_evaluation)
      : NamedKey(std::move(its_name), Resume::fixed, in_evaluation) {}
  operator const std::string&() const { return name; }  // NOLINT: most visitors need no more
  /// Elsewhere it is named without its section.
  operator NamedOption() const { return {name.substr(name.rfind('.') + 1)}; }  // NOLINT

  std::string name;
  Resume resume = Resume::fixed;
  Evaluation evaluation = Evaluation::counts;
};

}  // namespace pictura
