// Faults of a file that have only one sensible meaning. They are repaired and recorded.
#pragma once

#include <string>
#include <utility>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/map/repairs.h"

namespace pictura::opendrive {

class Faults {
 public:
  explicit Faults(bool strict) : strict_(strict) {}

  /// Records a fault, which the caller repairs as action_of(kind) describes. In strict reading, throws Error instead.
  void record_repair(Repair repair, const std::string& source) {
    if (strict_) throw Error(message_of(repair, source));
    // The limit bounds memory.
    if (repairs_.size() >= kMaxRepairs) {
      fail("{} (after {} other faults, the maximum that is repaired)", message_of(repair, source), kMaxRepairs);
    }
    repairs_.push_back(std::move(repair));
  }

  std::vector<Repair> take() { return std::move(repairs_); }

 private:
  static constexpr std::size_t kMaxRepairs = 1'000'000;

  bool strict_;
  std::vector<Repair> repairs_;
};

}  // namespace pictura::opendrive
