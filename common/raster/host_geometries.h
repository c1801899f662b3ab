// Maps' looks that a renderer keeps on the host, by their handles.
#pragma once

#include <deque>
#include <vector>

#include "pictura/common/scene.h"

namespace pictura {

class HostGeometries {
 public:
  /// Keeps a copy.
  GeometryHandle add(const StaticGeometry& geometry) {
    copies_.push_back(geometry);
    views_.push_back(copies_.back().view());
    return static_cast<GeometryHandle>(views_.size()) - 1;
  }
  Span<const StaticGeometryView> views() const { return views_; }
  const StaticGeometryView& operator[](GeometryHandle handle) const { return views_[static_cast<std::size_t>(handle)]; }

 private:
  std::deque<StaticGeometry> copies_;  // their addresses stay: views_ point into them
  std::vector<StaticGeometryView> views_;
};

}  // namespace pictura
