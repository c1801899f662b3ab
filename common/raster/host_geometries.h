// Copies of maps' geometries that a renderer keeps on the host, by the handles that its caller chose.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/scene.h"

namespace pictura {

/// Handles are checked before (check_handle).
class HostGeometries {
 public:
  /// Keeps a copy in place of what the handle held before.
  void upload(GeometryHandle handle, const StaticGeometry& geometry) {
    const auto index = static_cast<std::size_t>(handle);
    if (index >= kept_.size()) kept_.resize(index + 1);
    kept_[index] = std::make_unique<const Kept>(geometry);
  }
  /// Frees what the handle holds, if anything.
  void release(GeometryHandle handle) {
    if (static_cast<std::size_t>(handle) < kept_.size()) kept_[handle].reset();
  }
  /// What any handle holds; null where it holds nothing.
  const StaticGeometryView* find(GeometryHandle handle) const {
    if (handle < 0 || static_cast<std::size_t>(handle) >= kept_.size()) return nullptr;
    const auto& kept = kept_[handle];
    return kept ? &kept->view : nullptr;
  }

 private:
  struct Kept {
    explicit Kept(const StaticGeometry& geometry) : copy(geometry), view(copy.view()) {}
    StaticGeometry copy;
    StaticGeometryView view;  // points into the copy
  };
  std::vector<std::unique_ptr<const Kept>> kept_;  // [handle]
};

}  // namespace pictura
