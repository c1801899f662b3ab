// Descriptions of options. Each struct of options has one list of descriptions: visit_options(options, visitor) calls
// the visitor with each option's description and value. Keyword arguments in Python, flags of commands and keys of
// configuration files come from these lists.
#pragma once

#include <limits>
#include <string>
#include <utility>

namespace pictura {

/// An option, with the details that its type and default do not give.
struct NamedOption {
  std::string name;                                        // name in Python
  const char *flag = nullptr, *help = nullptr;             // flag and help in commands; null: no flag
  double low = 0, high = std::numeric_limits<int>::max();  // range of the flag's numbers
};

/// Changes of a key's value that a resumed run accepts: none (fixed), any (free), or any with a notice (reported).
enum class Resume { fixed, free, reported };

/// Use of a key's value in evaluations. counts: evaluations that read the key's section use the value. replaced:
/// evaluations have a separate option instead.
enum class Evaluation { counts, replaced };

/// A key of a configuration file, with the details that its type, default and range do not give.
struct NamedKey {
  NamedKey(const char* its_name) : name(its_name) {}                // NOLINT: most keys are a name alone
  NamedKey(std::string its_name, Resume at_resume = Resume::fixed,  // NOLINT
           Evaluation in_evaluation = Evaluation::counts)
      : name(std::move(its_name)), resume(at_resume), evaluation(in_evaluation) {}
  NamedKey(std::string its_name, Evaluation in_evaluation)
      : NamedKey(std::move(its_name), Resume::fixed, in_evaluation) {}
  operator const std::string&() const { return name; }  // NOLINT: most visitors need no more
  /// Converts to an option, named by the part of the key after its section.
  operator NamedOption() const { return {name.substr(name.rfind('.') + 1)}; }  // NOLINT

  std::string name;
  Resume resume = Resume::fixed;
  Evaluation evaluation = Evaluation::counts;
};

}  // namespace pictura
