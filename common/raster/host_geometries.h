// Host copies of maps' geometries, for renderers.
#pragma once

#include <memory>
#include <vector>

#include "pictura/common/scene.h"

namespace pictura {

/// Map from handles to geometries. Check handles with check_handle() before upload().
class HostGeometries {
 public:
  void upload(GeometryHandle handle, const StaticGeometry& geometry) {
    const auto index = static_cast<std::size_t>(handle);
    if (index >= kept_.size()) kept_.resize(index + 1);
    kept_[index] = std::make_unique<const Kept>(geometry);
  }
  void release(GeometryHandle handle) {
    if (static_cast<std::size_t>(handle) < kept_.size()) kept_[handle].reset();
  }
  /// Returns the handle's geometry or null. Accepts any handle.
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
