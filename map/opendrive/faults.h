// What a fault in a file does: it ends the reading, or the smallest part around it is left out and the reason noted.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error.h"

namespace pictura::opendrive {

class Faults {
 public:
  explicit Faults(bool lenient) : lenient_(lenient) {}

  /// Runs `part()`. Strict: passes its Error on. Lenient: notes it as a warning and returns false. Parts must leave
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
      warnings_.emplace_back(error.what());
      return false;
    }
  }

  bool is_lenient() const { return lenient_; }
  std::vector<std::string> take_warnings() { return std::move(warnings_); }

 private:
  bool lenient_;
  std::vector<std::string> warnings_;
};

}  // namespace pictura::opendrive
