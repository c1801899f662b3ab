// Host copies of the geometries of maps for a renderer, by handle.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/scene.h"

namespace pictura {

/// Map from handles to geometries. Callers of upload() must first check the handle with check_handle().
class HostGeometries {
 public:
  /// Copies a geometry, replacing the handle's previous geometry.
  void upload(GeometryHandle handle, const StaticGeometry& geometry) {
    const auto index = static_cast<std::size_t>(handle);
    if (index >= kept_.size()) kept_.resize(index + 1);
    kept_[index] = std::make_unique<const Kept>(geometry);
  }
  /// Frees the handle's geometry, if any.
  void release(GeometryHandle handle) {
    if (static_cast<std::size_t>(handle) < kept_.size()) kept_[handle].reset();
  }
  /// Returns the handle's geometry; null for a handle without geometry. Accepts any handle.
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
