#include "pictura/backend_cpu/renderer_cpu_image.h"

#include <algorithm>
#include <limits>

namespace pictura {

namespace {
// Images are composited in bands of rows, so that the state of their pixels stays in the cache whatever their size.
constexpr int kBandPixels = 1 << 14;
// Numbers of things are unique: kind, then index.
constexpr uint32_t kAgentNumber = 0u << 28, kWallNumber = 1u << 28, kLightNumber = 2u << 28, kStripNumber = 3u << 28;
}  // namespace

template <typename MakeFaces>
ImageDrawer::Item* ImageDrawer::add_item(MakeFaces&& make_faces) {
  const auto face_begin = static_cast<int32_t>(faces_.size());
  Item item;
  item.face_begin = face_begin;
  make_faces([&](const Vec3* corners, int count, Rgb color) {
    Vec3 polygon[kMaxPolygonCorners];
    const int kept = clip_face(frustum_, corners, count, polygon);
    if (kept < 3) return;
    const std::size_t edge_begin = edges_.size();
    edges_.resize(edge_begin + static_cast<std::size_t>(kept));
    ScreenFace face;
    if (!make_screen_face(request_.camera, polygon, kept, color, edges_.data() + edge_begin, &face)) {
      edges_.resize(edge_begin);
      return;
    }
    face.edge_begin = static_cast<int32_t>(edge_begin);
    edges_.resize(edge_begin + static_cast<std::size_t>(face.edge_count));
    item.box = faces_.size() == static_cast<std::size_t>(face_begin) ? face.box : united(item.box, face.box);
    faces_.push_back(face);
  });
  item.face_end = static_cast<int32_t>(faces_.size());
  if (item.face_begin == item.face_end) return nullptr;
  items_.push_back(item);
  return &items_.back();
}

void ImageDrawer::gather_agents() {
  const SceneBatch& scene = *request_.scene;
  const auto world = static_cast<std::size_t>(request_.view->world);
  for (int32_t agent = scene.world_begin[world]; agent < scene.world_begin[world + 1]; ++agent) {
    const AgentBox& box = scene.agents[static_cast<std::size_t>(agent)];
    if (!may_show(box, request_.camera, frustum_)) continue;
    if (is_left_out(*request_.view, scene.hidden_agents, agent)) continue;
    Item* item = add_item([&](auto&& emit) { agent_faces(box, request_.camera, request_.debug_palette, emit); });
    if (!item) continue;
    item->agent = agent;
    item->surface =
        static_cast<SurfaceClass>(static_cast<int>(SurfaceClass::vehicle) + static_cast<int>(box.agent_class));
    item->extent = agent_extent(box, request_.camera.position_m);
    item->key = {nearest_distance2(item->extent),
                 kAgentNumber | static_cast<uint32_t>(agent - scene.world_begin[world])};
  }
}

void ImageDrawer::gather_walls() {
  const RasterGeometry& geometry = *request_.geometry;
  const float far_m = far_of(geometry.longest_wall_m);
  for_each_item(
      geometry.pieces.wall_grid, frustum_ground_box(request_.camera, frustum_, far_m),
      [&](int32_t i) { return ground_box(geometry.pieces.walls[static_cast<std::size_t>(i)]); },
      [&](int32_t i) {
        const WallFace& wall = geometry.pieces.walls[static_cast<std::size_t>(i)];
        if (!may_show(wall, request_.camera, frustum_, far_m)) return;
        Item* item = add_item([&](auto&& emit) { wall_faces(wall, request_.camera, emit); });
        if (!item) return;
        item->surface = SurfaceClass::wall;
        item->extent = wall_extent(wall, request_.camera.position_m);
        item->key = {nearest_distance2(item->extent), kWallNumber | static_cast<uint32_t>(i)};
      });
}

void ImageDrawer::gather_lights() {
  const SceneBatch& scene = *request_.scene;
  const auto world = static_cast<std::size_t>(request_.view->world);
  const auto light_begin = static_cast<std::size_t>(scene.light_begin[world]);
  if (light_begin == static_cast<std::size_t>(scene.light_begin[world + 1])) return;
  const Span<const LightHead> heads = request_.geometry->pieces.heads;
  for (std::size_t i = 0; i < heads.size(); ++i) {
    const LightState state = scene.light_states[light_begin + static_cast<std::size_t>(heads[i].signal)];
    const Vec3 center = to_camera(request_.camera, heads[i].position_m);
    if (!ball_in_frustum(frustum_, center, 1.1f * kLightRadius_m, far_of(kLightRadius_m))) continue;
    Item* item = add_item([&](auto&& emit) { light_faces(heads[i], state, request_.camera, emit); });
    if (!item) continue;
    item->surface = SurfaceClass::light;
    item->extent = light_extent(heads[i], request_.camera.position_m);
    item->key = {nearest_distance2(item->extent), kLightNumber | static_cast<uint32_t>(i)};
  }
}

void ImageDrawer::gather_strips() {
  const RasterGeometry& geometry = *request_.geometry;
  float lowest_foot_m = std::numeric_limits<float>::max();
  for (const Item& item : items_) {
    for (int i = 0; i < item.extent.corners; ++i) lowest_foot_m = min_of(lowest_foot_m, item.extent.low_m[i]);
  }
  const float far_m = far_of(geometry.longest_strip_m);
  for_each_item(
      geometry.pieces.strip_grid, frustum_ground_box(request_.camera, frustum_, far_m),
      [&](int32_t i) { return ground_box(geometry.pieces.strips[static_cast<std::size_t>(i)]); },
      [&](int32_t i) {
        const Strip& strip = geometry.pieces.strips[static_cast<std::size_t>(i)];
        if (!may_show(strip, request_.camera, frustum_, far_m)) return;
        Item* item = add_item([&](auto&& emit) { strip_faces(strip, request_.camera, request_.line_floor_px, emit); });
        if (!item) return;
        item->surface = SurfaceClass::strip;
        item->strip_kind = static_cast<int32_t>(strip.kind);
        const float high_m = max_of(strip.a_m.z, strip.b_m.z) - request_.camera.position_m.z;
        item->is_background = lies_behind_all(high_m, lowest_foot_m);
        if (item->is_background) {
          item->key = {0.0f, rank_of(strip, static_cast<uint32_t>(i))};
        } else {
          item->extent = strip_extent(strip, static_cast<uint32_t>(i), request_.camera.position_m);
          item->key = {nearest_distance2(item->extent), kStripNumber | static_cast<uint32_t>(i)};
        }
      });
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

  // Pairwise order of what overlaps on screen, then a topological sort that takes the nearest of those that nothing is
  // in front of any more; in a cycle, the nearest.
  const std::size_t count = foreground_.size(), words = (count + 63) / 64;
  is_before_.assign(count * words, 0);
  waiting_for_.assign(count, 0);
  for (std::size_t i = 0; i < count; ++i) {
    const Item& a = items_[static_cast<std::size_t>(foreground_[i])];
    for (std::size_t j = i + 1; j < count; ++j) {
      const Item& b = items_[static_cast<std::size_t>(foreground_[j])];
      if (!overlap(a.box, b.box)) continue;
      const int first = order_of(a.extent, b.extent);
      if (first == 0) continue;
      const std::size_t before = first < 0 ? i : j, after = first < 0 ? j : i;
      is_before_[before * words + after / 64] |= uint64_t{1} << (after % 64);
      ++waiting_for_[after];
    }
  }
  const std::size_t background = order_.size();
  constexpr int32_t kTaken = -1;
  std::size_t first_left = 0;
  for (std::size_t taken = 0; taken < count; ++taken) {
    while (waiting_for_[first_left] == kTaken) ++first_left;
    std::size_t next = first_left;
    while (next < count && waiting_for_[next] != 0) ++next;
    if (next == count) next = first_left;
    order_.push_back(foreground_[next]);
    waiting_for_[next] = kTaken;
    for (std::size_t word = 0; word < words; ++word) {
      for (uint64_t bits = is_before_[next * words + word]; bits != 0; bits &= bits - 1) {
        int32_t& waiting = waiting_for_[64 * word + static_cast<std::size_t>(__builtin_ctzll(bits))];
        if (waiting != kTaken) --waiting;
      }
    }
  }
  std::rotate(order_.begin(), order_.begin() + static_cast<std::ptrdiff_t>(background), order_.end());
}

void ImageDrawer::prepare(const ImageRequest& request) {
  request_ = request;
  frustum_ = make_frustum(request.camera);
  edges_.clear();
  faces_.clear();
  items_.clear();
  gather_agents();
  gather_walls();
  gather_lights();
  gather_strips();
  sort_items();
}

// Calls visit(pixel index in rows y_begin.., coverage, face) for each pixel of the rows that the item may cover.
template <typename Visit>
void ImageDrawer::visit_pixels(const Item& item, int y_begin, int y_end, Visit&& visit) const {
  const int width = request_.camera.width_px;
  for (int32_t f = item.face_begin; f < item.face_end; ++f) {
    const ScreenFace& face = faces_[static_cast<std::size_t>(f)];
    const PolygonEdge* edges = edges_.data() + face.edge_begin;
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
  const int width = request_.camera.width_px, height = request_.camera.height_px;
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
    } else {
      write(static_cast<float*>(target.color), [](float channel) { return clamp(channel, 0.0f, 1.0f); });
    }
  }
  if (target.depth_m || target.class_id || target.instance_id) draw_planes(target);
}

void ImageDrawer::draw_planes(const ImageTarget& target) const {
  const int width = request_.camera.width_px, height = request_.camera.height_px;
  const std::size_t plane = static_cast<std::size_t>(width) * static_cast<std::size_t>(height);
  if (target.depth_m) std::fill_n(target.depth_m, plane, std::numeric_limits<float>::infinity());
  if (target.class_id) std::fill_n(target.class_id, plane, uint8_t{0});
  if (target.instance_id) std::fill_n(target.instance_id, plane, uint16_t{0});
  const int32_t world_begin = request_.scene->world_begin[static_cast<std::size_t>(request_.view->world)];
  // Back to front, so that what is in front is written last.
  for (auto i = order_.rbegin(); i != order_.rend(); ++i) {
    const Item& item = items_[static_cast<std::size_t>(*i)];
    for (int32_t f = item.face_begin; f < item.face_end; ++f) {
      const ScreenFace& face = faces_[static_cast<std::size_t>(f)];
      for (int y = face.box.y_begin; y < face.box.y_end; ++y) {
        for (int x = face.box.x_begin; x < face.box.x_end; ++x) {
          const float x_px = static_cast<float>(x) + 0.5f, y_px = static_cast<float>(y) + 0.5f;
          if (!covers_point(edges_.data() + face.edge_begin, face.edge_count, x_px, y_px)) continue;
          const std::size_t pixel =
              static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
          if (target.depth_m) target.depth_m[pixel] = face_depth_m(face, x_px, y_px);
          if (target.class_id) {
            target.class_id[pixel] = static_cast<uint8_t>(static_cast<int>(item.surface) + item.strip_kind);
          }
          if (target.instance_id) {
            target.instance_id[pixel] = static_cast<uint16_t>(item.agent < 0 ? 0 : 1 + item.agent - world_begin);
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
  const Item& wanted = items_[static_cast<std::size_t>(*found)];
  const int width = request_.camera.width_px;
  const int band_rows = max_of(1, kBandPixels / width);
  for (int y_begin = wanted.box.y_begin; y_begin < wanted.box.y_end; y_begin += band_rows) {
    const int y_end = min_of(wanted.box.y_end, y_begin + band_rows);
    auto weigh = [&](std::vector<int32_t>::const_iterator begin) {
      double weight = 0;
      pixels_.assign(static_cast<std::size_t>((y_end - y_begin) * width), PixelState{});
      for (auto i = begin; i <= found; ++i) {
        const Item& item = items_[static_cast<std::size_t>(*i)];
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
