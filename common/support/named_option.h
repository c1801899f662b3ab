// Descriptions of options, from which Python arguments, flags of commands and configuration keys come.
// visit_options(options, visitor) calls the visitor with each option's description and value.
#pragma once

#include <limits>
#include <string>
#include <utility>

namespace pictura {

/// Old name of a choice. Commands and Python accept it with a warning until the next version.
struct RenamedChoice {
  const char *old_name = nullptr, *name = nullptr;

  /// Warning for an option whose value is the old name.
  std::string warning(const std::string& option) const {
    return option + ": '" + old_name + "' is deprecated: use '" + name + "'";
  }
};

struct NamedOption {
  std::string name;                                        // name in Python
  const char *flag = nullptr, *help = nullptr;             // in commands; null: no flag
  double low = 0, high = std::numeric_limits<int>::max();  // range of numbers
  RenamedChoice renamed{};                                 // old name of a choice
};

/// Changes of a key's value that a resumed run accepts. reported: any change, with a notice.
enum class Resume { fixed, free, reported };

/// Use of a training run's value in evaluations. counts: evaluations use it. replaced: evaluations have a separate
/// option.
enum class Evaluation { counts, replaced };

/// A key of a configuration file.
struct NamedKey {
  NamedKey(const char* its_name) : name(its_name) {}                // NOLINT: most keys have only a name
  NamedKey(std::string its_name, Resume at_resume = Resume::fixed,  // NOLINT
           Evaluation in_evaluation = Evaluation::counts)
      : name(std::move(its_name)), resume(at_resume), evaluation(in_evaluation) {}
  NamedKey(std::string its_name, Evaluation in_evaluation)
      : NamedKey(std::move(its_name), Resume::fixed, in_evaluation) {}
  operator const std::string&() const { return name; }  // NOLINT: most visitors need only the name
  /// Option named by the part of the key after its section.
  operator NamedOption() const { return {name.substr(name.rfind('.') + 1)}; }  // NOLINT

  std::string name;
  Resume resume = Resume::fixed;
  Evaluation evaluation = Evaluation::counts;
};

}  // namespace pictura
