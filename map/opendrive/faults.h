// Handling of faults in a file: strict mode throws; lenient mode drops the smallest faulty part and records a warning.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error.h"

namespace pictura::opendrive {

class Faults {
 public:
  explicit Faults(bool lenient) : lenient_(lenient) {}

  /// Runs `part()`. Strict: propagates its Error. Lenient: records it as a warning and returns false. Parts must leave
  /// nothing half done when they throw.
  template <typename Part>
  bool attempt(Part&& part) {
    if (!lenient_) {
      part();
      return true;
    }
    try {
      part();
      return true;
    } catch (const Error& error) {
      ++num_faults_;
      if (warnings_.size() < kMaxWarnings) warnings_.emplace_back(error.what());
      return false;
    }
  }

  /// The recorded warnings and, if there were more than the limit, how many more.
  std::vector<std::string> take_warnings() {
    if (num_faults_ > warnings_.size()) warnings_.push_back(fmt::format("and {} more", num_faults_ - warnings_.size()));
    return std::move(warnings_);
  }

 private:
  static constexpr std::size_t kMaxWarnings = 10'000;

  bool lenient_;
  std::size_t num_faults_ = 0;
  std::vector<std::string> warnings_;
};

}  // namespace pictura::opendrive
