// Faults of a file that have one sensible meaning. They are repaired and recorded, or refused in strict reading.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/map/mends.h"

namespace pictura::opendrive {

class Faults {
 public:
  explicit Faults(bool strict) : strict_(strict) {}

  /// Records a fault that the caller repairs by action_of(kind). In strict reading, throws Error with its message
  /// instead.
  void mend(Mend mend, const std::string& source) {
    if (strict_) throw Error(message_of(mend, source));
    // The limit bounds memory.
    if (mends_.size() >= kMaxMends) {
      fail("{} (after {} other faults, the maximum that is repaired)", message_of(mend, source), kMaxMends);
    }
    mends_.push_back(std::move(mend));
  }

  std::vector<Mend> take() { return std::move(mends_); }

 private:
  static constexpr std::size_t kMaxMends = 1'000'000;

  bool strict_;
  std::vector<Mend> mends_;
};

}  // namespace pictura::opendrive
