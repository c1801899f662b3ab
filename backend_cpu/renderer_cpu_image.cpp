#include "pictura/backend_cpu/renderer_cpu_image.h"

#include <algorithm>
#include <functional>
#include <limits>

#include "pictura/common/raster_gather.h"

namespace pictura {

namespace {
// Images are composited in bands of rows, so that the state of their pixels stays in the cache whatever their size.
constexpr int kBandPixels = 1 << 14;
constexpr int32_t kNone = -1;
}  // namespace

template <typename MakeFaces>
void ImageDrawer::add_item(const RasterItem& item, MakeFaces&& make_faces) {
  ItemFaces faces;
  make_faces([&](const Vec3* corners, int count, const FacePlane& plane, Rgb color) {
    add_face(setting_, corners, count, plane, color, edges_, &faces);
  });
  if (faces.count == 0) return;
  items_.push_back(item);
  items_.back().box = faces.box;
  items_.back().face_begin = static_cast<int32_t>(faces_.size());
  faces_.insert(faces_.end(), faces.face, faces.face + faces.count);
  items_.back().face_end = static_cast<int32_t>(faces_.size());
}

void ImageDrawer::gather() {
  const SceneBatch& scene = *request_.scene;
  const View& view = *request_.view;
  const RasterGeometry& geometry = *request_.geometry;
  const int32_t world_begin = scene.world_begin[static_cast<std::size_t>(view.world)];
  visit_agents(setting_, scene, view, [&](const AgentBox& box, int32_t agent) {
    add_item(agent_item(setting_, box, agent, world_begin),
             [&](auto&& emit) { agent_faces(box, setting_.camera, setting_.debug_palette, emit); });
  });
  visit_walls(setting_, geometry, [&](const WallFace& wall, int32_t i) {
    add_item(wall_item(setting_, wall, i), [&](auto&& emit) { wall_faces(wall, setting_.camera, emit); });
  });
  visit_lights(setting_, geometry, scene, view, [&](const LightHead& head, LightState state, int32_t i) {
    add_item(light_item(setting_, head, i), [&](auto&& emit) { light_faces(head, state, setting_.camera, emit); });
  });
  visit_strips(setting_, geometry, [&](const Strip& strip, int32_t i) {
    add_item(strip_item(setting_, strip, i),
             [&](auto&& emit) { strip_faces(strip, setting_.camera, setting_.line_floor_px, emit); });
  });
}

void ImageDrawer::find_background() {
  GroundHeights heights;
  for (const RasterItem& item : items_) {
    const Interval of_item = heights_of(item.extent);
    if (item.extent.is_strip) {
      heights.strips.low = min_of(heights.strips.low, of_item.low);
      heights.strips.high = max_of(heights.strips.high, of_item.high);
    } else {
      heights.lowest_foot_m = min_of(heights.lowest_foot_m, of_item.low);
    }
  }
  if (!ground_is_level(heights)) return;
  for (RasterItem& item : items_) {
    if (item.extent.is_strip) put_in_background(&item);
  }
}

void ImageDrawer::sort_items() {
  order_.clear();
  foreground_.clear();
  for (std::size_t i = 0; i < items_.size(); ++i) {
    (items_[i].is_background ? order_ : foreground_).push_back(static_cast<int32_t>(i));
  }
  auto by_key = [&](int32_t a, int32_t b) {
    return items_[static_cast<std::size_t>(a)].key < items_[static_cast<std::size_t>(b)].key;
  };
  std::sort(order_.begin(), order_.end(), by_key);
  std::sort(foreground_.begin(), foreground_.end(), by_key);
  const auto background = static_cast<std::ptrdiff_t>(order_.size());
  find_hidings();
  sort_foreground();
  std::rotate(order_.begin(), order_.begin() + background, order_.end());
}

// Pairwise order of what meets on screen. A sweep over x finds the pairs whose boxes overlap.
void ImageDrawer::find_hidings() {
  const std::size_t count = foreground_.size();
  hidings_.clear();
  first_hiding_.assign(count, kNone);
  waiting_for_.assign(count, 0);
  sweep_.clear();
  for (std::size_t i = 0; i < count; ++i) {
    sweep_.push_back({items_[static_cast<std::size_t>(foreground_[i])].box, static_cast<int32_t>(i)});
  }
  std::sort(sweep_.begin(), sweep_.end(),
            [](const PlacedBox& a, const PlacedBox& b) { return a.box.x_begin < b.box.x_begin; });
  for (std::size_t i = 0; i < count; ++i) {
    const PlacedBox& a = sweep_[i];
    for (std::size_t j = i + 1; j < count && sweep_[j].box.x_begin < a.box.x_end; ++j) {
      const PlacedBox& b = sweep_[j];
      if (a.box.y_begin >= b.box.y_end || b.box.y_begin >= a.box.y_end) continue;
      const int32_t nearer = min_of(a.place, b.place), farther = max_of(a.place, b.place);
      const int32_t order =
          order_on_screen(items_[static_cast<std::size_t>(foreground_[static_cast<std::size_t>(nearer)])],
                          items_[static_cast<std::size_t>(foreground_[static_cast<std::size_t>(farther)])],
                          faces_.data(), edges_.at(0));
      if (order == 0) continue;
      const int32_t front = order < 0 ? nearer : farther, behind = order < 0 ? farther : nearer;
      const int32_t weight = order < 0 ? -order : order;
      int32_t& first = first_hiding_[static_cast<std::size_t>(front)];
      hidings_.push_back({behind, weight, first});
      first = static_cast<int32_t>(hidings_.size()) - 1;
      waiting_for_[static_cast<std::size_t>(behind)] += weight;
    }
  }
}

// A topological sort that takes the nearest of those that nothing is in front of any more; in a cycle, the one of which
// least is hidden by what is left.
void ImageDrawer::sort_foreground() {
  const std::size_t count = foreground_.size();
  constexpr int64_t kTaken = -1;
  ready_.clear();  // a heap of places, the nearest on top
  for (std::size_t i = 0; i < count; ++i) {
    if (waiting_for_[i] == 0) ready_.push_back(static_cast<int32_t>(i));
  }
  for (std::size_t taken = 0; taken < count; ++taken) {
    std::size_t next = 0;
    if (!ready_.empty()) {
      std::pop_heap(ready_.begin(), ready_.end(), std::greater<>());
      next = static_cast<std::size_t>(ready_.back());
      ready_.pop_back();
    } else {
      while (waiting_for_[next] == kTaken) ++next;
      for (std::size_t i = next + 1; i < count; ++i) {
        if (waiting_for_[i] != kTaken && waiting_for_[i] < waiting_for_[next]) next = i;
      }
    }
    order_.push_back(foreground_[next]);
    waiting_for_[next] = kTaken;
    for (int32_t at = first_hiding_[next]; at != kNone; at = hidings_[static_cast<std::size_t>(at)].next) {
      const Hiding& hiding = hidings_[static_cast<std::size_t>(at)];
      int64_t& waiting = waiting_for_[static_cast<std::size_t>(hiding.behind)];
      if (waiting == kTaken) continue;
      waiting -= hiding.weight;
      if (waiting > 0) continue;
      ready_.push_back(hiding.behind);
      std::push_heap(ready_.begin(), ready_.end(), std::greater<>());
    }
  }
}

void ImageDrawer::prepare(const ImageRequest& request) {
  request_ = request;
  setting_ = {request.camera, make_frustum(request.camera), request.line_floor_px, request.debug_palette};
  edges_.clear();
  faces_.clear();
  items_.clear();
  gather();
  find_background();
  sort_items();
}

// Calls visit(pixel index in rows y_begin.., coverage, face) for each pixel of the rows that the item may cover.
template <typename Visit>
void ImageDrawer::visit_pixels(const RasterItem& item, int y_begin, int y_end, Visit&& visit) const {
  const int width = setting_.camera.width_px;
  for (int32_t f = item.face_begin; f < item.face_end; ++f) {
    const ScreenFace& face = faces_[static_cast<std::size_t>(f)];
    const PolygonEdge* edges = edges_.at(face.edge_begin);
    for (int y = max_of(y_begin, face.box.y_begin); y < min_of(y_end, face.box.y_end); ++y) {
      const RowSpan span = row_span(edges, face.edge_count, face.box, y);
      const int row = (y - y_begin) * width;
      for (int x = span.begin; x < span.full_begin; ++x) {
        visit(row + x, [&] { return pixel_coverage(edges, face.edge_count, x, y); }, face);
      }
      for (int x = span.full_begin; x < span.full_end; ++x) {
        visit(row + x, [&] { return PixelCoverage{1.0f, kAllSamples}; }, face);
      }
      for (int x = span.full_end; x < span.end; ++x) {
        visit(row + x, [&] { return pixel_coverage(edges, face.edge_count, x, y); }, face);
      }
    }
  }
}

void ImageDrawer::draw(const ImageTarget& target) {
  const int width = setting_.camera.width_px, height = setting_.camera.height_px;
  const int band_rows = max_of(1, min_of(height, kBandPixels / width));
  const int64_t plane = int64_t{width} * height;
  for (int y_begin = 0; y_begin < height; y_begin += band_rows) {
    const int y_end = min_of(height, y_begin + band_rows);
    const int count = (y_end - y_begin) * width;
    pixels_.assign(static_cast<std::size_t>(count), PixelState{});
    for (const int32_t i : order_) {
      visit_pixels(items_[static_cast<std::size_t>(i)], y_begin, y_end,
                   [&](int index, auto&& coverage, const ScreenFace& face) {
                     PixelState& pixel = pixels_[static_cast<std::size_t>(index)];
                     if (pixel.free_area > 0.0f) composite(&pixel, coverage(), face.color);
                   });
    }
    const int64_t first = int64_t{y_begin} * width;
    auto write = [&](auto* out, auto&& value_of) {
      out += first;
      for (int i = 0; i < count; ++i) {
        const Rgb& color = pixels_[static_cast<std::size_t>(i)].color;
        out[i] = value_of(color.r);
        out[plane + i] = value_of(color.g);
        out[2 * plane + i] = value_of(color.b);
      }
    };
    if (target.format == PixelFormat::u8) {
      write(static_cast<uint8_t*>(target.color), [](float channel) { return to_byte(channel); });
    } else if (target.format == PixelFormat::f16) {
      write(static_cast<uint16_t*>(target.color), [](float channel) { return to_half(channel); });
    } else {
      write(static_cast<float*>(target.color), [](float channel) { return clamp(channel, 0.0f, 1.0f); });
    }
  }
  if (target.depth_m || target.class_id || target.instance_id) draw_planes(target);
}

void ImageDrawer::visit_fragments(const std::function<void(int, const PixelCoverage&, Rgb)>& visit) const {
  for (const int32_t i : order_) {
    visit_pixels(items_[static_cast<std::size_t>(i)], 0, setting_.camera.height_px,
                 [&](int index, auto&& coverage, const ScreenFace& face) { visit(index, coverage(), face.color); });
  }
}

void ImageDrawer::draw_planes(const ImageTarget& target) const {
  const int width = setting_.camera.width_px, height = setting_.camera.height_px;
  const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (target.depth_m) std::fill_n(target.depth_m, plane, std::numeric_limits<float>::infinity());
  if (target.class_id) std::fill_n(target.class_id, plane, uint8_t{0});
  if (target.instance_id) std::fill_n(target.instance_id, plane, uint16_t{0});
  const int32_t world_begin = request_.scene->world_begin[static_cast<std::size_t>(request_.view->world)];
  // Back to front, so that what is in front is written last.
  for (auto i = order_.rbegin(); i != order_.rend(); ++i) {
    const RasterItem& item = items_[static_cast<std::size_t>(*i)];
    for (int32_t f = item.face_begin; f < item.face_end; ++f) {
      const ScreenFace& face = faces_[static_cast<std::size_t>(f)];
      for (int y = face.box.y_begin; y < face.box.y_end; ++y) {
        for (int x = face.box.x_begin; x < face.box.x_end; ++x) {
          const float x_px = static_cast<float>(x) + 0.5f, y_px = static_cast<float>(y) + 0.5f;
          if (!covers_point(edges_.at(face.edge_begin), face.edge_count, x_px, y_px)) continue;
          const std::size_t pixel =
              static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
          if (target.depth_m) target.depth_m[pixel] = face_depth_m(face, x_px, y_px);
          if (target.class_id) {
            target.class_id[pixel] = item.class_id;
          }
          if (target.instance_id) {
            target.instance_id[pixel] = instance_of(item, world_begin);
          }
        }
      }
    }
  }
}

ImageDrawer::Coverage ImageDrawer::coverage_of(int32_t agent) {
  const auto found = std::find_if(order_.begin(), order_.end(),
                                  [&](int32_t i) { return items_[static_cast<std::size_t>(i)].agent == agent; });
  Coverage sum;
  if (found == order_.end()) return sum;
  const RasterItem& wanted = items_[static_cast<std::size_t>(*found)];
  const int width = setting_.camera.width_px;
  const int band_rows = max_of(1, kBandPixels / width);
  for (int y_begin = wanted.box.y_begin; y_begin < wanted.box.y_end; y_begin += band_rows) {
    const int y_end = min_of(wanted.box.y_end, y_begin + band_rows);
    auto weigh = [&](std::vector<int32_t>::const_iterator begin) {
      double weight = 0;
      pixels_.assign(static_cast<std::size_t>((y_end - y_begin) * width), PixelState{});
      for (auto i = begin; i <= found; ++i) {
        const RasterItem& item = items_[static_cast<std::size_t>(*i)];
        visit_pixels(item, y_begin, y_end, [&](int index, auto&& coverage, const ScreenFace& face) {
          const float laid = composite(&pixels_[static_cast<std::size_t>(index)], coverage(), face.color);
          if (&item == &wanted) weight += laid;
        });
      }
      return weight;
    };
    sum.seen += weigh(order_.cbegin());
    sum.alone += weigh(found);
  }
  return sum;
}

}  // namespace pictura
