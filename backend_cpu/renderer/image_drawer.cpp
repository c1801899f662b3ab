#include "pictura/backend_cpu/renderer/image_drawer.h"

#include <algorithm>
#include <bit>
#include <limits>

#include "pictura/backend_cpu/renderer/fast/coverage_x8.h"
#include "pictura/backend_cpu/renderer/fast/occlusion_x8.h"
#include "pictura/backend_cpu/renderer/fast/pairs_x8.h"
#include "pictura/backend_cpu/renderer/fast/strips_x8.h"
#include "pictura/common/raster/visible_primitives.h"

namespace pictura {

namespace {
// Images are drawn in bands of rows, so that the fragments stay in the cache for any image size.
constexpr int kBandPixels = 1 << 14;
}  // namespace

auto ImageDrawer::face_maker(PrimitiveRef primitive) {
  return [this, primitive](const CameraFace& face_in_camera) {
    ScreenFace face;
    if (make_face(setting_, primitive, face_in_camera, edges_, &face)) faces_.push_back(face);
  };
}

void ImageDrawer::prepare(const ImageRequest& request) {
  request_ = request;
  setting_ = {request.camera, make_frustum(request.camera), request.line_floor_px, request.debug_palette};
  find_solids();
  if (request.culls_occluded) find_occluders();
  edges_.clear();
  faces_.clear();
  for (const Solid& solid : solids_) face_maker(solid.primitive)(make_camera_face(solid.in_camera, 0.0f));
  make_lights();
  make_strips();
}

void ImageDrawer::make_lights() {
  const Span<const LightState> states = light_states_of(*request_.scene, *request_.view);
  if (states.empty()) return;
  request_.geometry->heads.find_visible(setting_.camera, setting_.frustum, &found_);
  for (const int32_t index : found_) {
    const LightHead& head = request_.geometry->view.heads[index];
    light_faces(head, states[head.signal], setting_.camera, face_maker(light_ref(index)));
  }
}

void ImageDrawer::make_strips() {
  strips_.clear();
  request_.geometry->strips.visit_visible(setting_.camera, setting_.frustum,
                                          frustum_ground_box(setting_.camera, setting_.frustum),
                                          [this](int32_t index) { strips_.push_back(index); });
  const Span<const Strip> strips = request_.geometry->view.strips;
  for (std::size_t begin = 0; begin < strips_.size(); begin += kLanes) {
    const int count = static_cast<int>(std::min(strips_.size() - begin, std::size_t{kLanes}));
    const Strip* eight[kLanes];
    for (int lane = 0; lane < kLanes; ++lane) eight[lane] = &strips[strips_[begin + (lane < count ? lane : 0)]];
    const StripsX8 made = set_up_strips(setting_, eight);
    for (unsigned lanes = (made.visible | made.crossing) & first_lanes_mask(count); lanes != 0; lanes &= lanes - 1) {
      const int lane = std::countr_zero(lanes);
      const Strip& strip = *eight[lane];
      const PrimitiveRef primitive = strip_ref(strip, strips_[begin + lane]);
      if ((made.crossing >> lane & 1) != 0) {
        strip_faces(strip, setting_.camera, setting_.line_floor_px, face_maker(primitive));
        continue;
      }
      const int32_t edge_begin = edges_.take(4);
      ScreenFace face;
      make_quad_face(
          setting_.camera, setting_.frustum, made.quad(lane), (made.clockwise >> lane & 1) != 0, made.plane(lane),
          made.color_of(lane), [&](int i, const PolygonEdge& edge) { edges_.put(edge_begin + i, edge); }, &face);
      faces_.push_back(complete_face(face, primitive, edge_begin));
    }
  }
}

// Calls visit(box, agent) for each agent that may be visible, in ascending order.
template <typename Visit>
void ImageDrawer::visit_boxes(Visit&& visit) {
  const SceneBatch& scene = *request_.scene;
  if (!request_.crowd) return visit_agents(setting_, scene, *request_.view, visit);
  request_.crowd->find_visible(setting_.camera, setting_.frustum, &found_);
  for (const int32_t found : found_) {
    const int32_t agent = world_begin() + found;
    if (!is_excluded(*request_.view, scene.hidden_agents, agent)) visit(scene.agents[agent], agent);
  }
}

void ImageDrawer::find_solids() {
  solids_.clear();
  auto add_unless_black = [this](const WorldQuad& quad, Solid solid) {
    if (quad_to_camera(quad, setting_.camera, &solid.in_camera)) solids_.push_back(solid);
  };
  visit_boxes([&](const AgentBox& box, int32_t agent) {
    const PrimitiveRef primitive = agent_ref(box, agent - world_begin());
    const bool may_occlude_others = may_occlude(box, setting_.camera);
    visit_front_facing(box, setting_.camera, [&](int face) {
      add_unless_black(cuboid_quad(box, face, setting_.debug_palette),
                       {primitive, face_entry(primitive.object_id, face), may_occlude_others, {}});
    });
  });
  const Aabb2 seen = frustum_ground_box(setting_.camera, setting_.frustum);
  request_.geometry->walls.visit_visible(setting_.camera, setting_.frustum, seen, [&](int32_t index) {
    const WallFace& wall = request_.geometry->view.walls[index];
    const PrimitiveRef primitive = wall_ref(index);
    add_unless_black(wall_quad(wall), {primitive, primitive.object_id, may_occlude(wall, setting_.camera), {}});
  });
}

void ImageDrawer::find_occluders() {
  occluding_.clear();
  for (const Solid& solid : solids_) {
    if (!solid.may_occlude) continue;
    OccludingFace face{.solid = &solid};
    face.covered_px2 = occluder_area_px2(setting_.camera, solid.in_camera, &face.quad, &face.is_clockwise);
    if (face.covered_px2 > 0.0f) occluding_.push_back(face);
  }
  const auto count = std::min(occluding_.size(), static_cast<std::size_t>(Occluders::kMaxCount));
  std::partial_sort(occluding_.begin(), occluding_.begin() + static_cast<std::ptrdiff_t>(count), occluding_.end(),
                    [](const OccludingFace& a, const OccludingFace& b) {
                      return a.covered_px2 != b.covered_px2 ? a.covered_px2 > b.covered_px2
                                                            : a.solid->entry < b.solid->entry;
                    });
  for (std::size_t i = 0; i < count; ++i) {
    const OccludingFace& face = occluding_[i];
    setting_.occluders.occluder[i] =
        make_occluder(setting_.camera, setting_.frustum, face.solid->in_camera.plane, face.quad, face.is_clockwise);
  }
  setting_.occluders.count = static_cast<int32_t>(count);
}

bool ImageDrawer::stands(uint32_t solid, uint32_t strip) const {
  const StaticGeometryView& pieces = request_.geometry->view;
  const AgentBox* agents = request_.scene->agents.data() + world_begin();
  return stands_on(extent_of(solid, pieces, agents), extent_of(strip, pieces, agents));
}

// Calls visit(y, row, spans, lane) for each row y of a face within `rows`. `row` is the index of the row's first pixel.
// Lane `lane` of `spans` is the row's span.
template <typename Visit>
void ImageDrawer::visit_spans(const ScreenFace& face, RowRange rows, Visit&& visit) const {
  const int width = setting_.camera.width_px;
  const int y_begin = max_of(rows.y_begin, face.box.y_begin), y_end = min_of(rows.y_end, face.box.y_end);
  for (int y = y_begin; y < y_end; y += kLanes) {
    const RowSpansX8 spans = row_spans_x8(edges_.at(face.edge_begin), face.edge_count, face.box, y);
    for (int lane = 0; lane < min_of(kLanes, y_end - y); ++lane) {
      visit(y + lane, (y + lane - rows.y_begin) * width, spans, lane);
    }
  }
}

// Finds, for each pixel of the rows, the largest occluder_bound() of the faces that cover the pixel fully.
void ImageDrawer::find_occluder_bounds(FaceRange faces, RowRange rows) {
  occluder_bounds_.assign((rows.y_end - rows.y_begin) * setting_.camera.width_px + kLanes, 0.0f);
  for (int32_t f = faces.begin; f < faces.end; ++f) {
    const ScreenFace& face = faces_[f];
    if (is_strip(face)) continue;  // strips have no bound
    visit_spans(face, rows, [&](int y, int row, const RowSpansX8& spans, int lane) {
      const int x_end = spans.full_end[lane];
      for (int x = spans.full_begin[lane]; x < x_end; x += kLanes) {
        raise_occluder_bounds_x8(face, x, x_end, y, &occluder_bounds_[row + x]);
      }
    });
  }
}

// Rasterizes faces into fragments, which form one linked list per pixel of the rows.
void ImageDrawer::make_fragments(FaceRange faces, RowRange rows) {
  find_occluder_bounds(faces, rows);
  first_fragment_.assign((rows.y_end - rows.y_begin) * setting_.camera.width_px, -1);
  int32_t num_fragments = 0;
  // Pixels that a face may cover partly, before their coverage is computed.
  struct {
    int32_t x[2 * kLanes] = {}, y[2 * kLanes] = {};
    int count = 0;
  } partial;
  const int width = setting_.camera.width_px;
  for (int32_t f = faces.begin; f < faces.end; ++f) {
    const ScreenFace& face = faces_[f];
    auto add = [&](int32_t pixel, const PixelCoverage& coverage) {
      fragments_[num_fragments] = {coverage, f, first_fragment_[pixel]};
      first_fragment_[pixel] = num_fragments++;
    };
    auto add_partial = [&] {
      coverage_x8(edges_.at(face.edge_begin), face.edge_count, face.min_area(), partial.x, partial.y,
                  min_of(partial.count, kLanes), [&](int lane, const PixelCoverage& coverage) {
                    add((partial.y[lane] - rows.y_begin) * width + partial.x[lane], coverage);
                  });
      std::copy_n(partial.x + kLanes, kLanes, partial.x);
      std::copy_n(partial.y + kLanes, kLanes, partial.y);
      partial.count -= kLanes;
    };
    visit_spans(face, rows, [&](int y, int row, const RowSpansX8& spans, int lane) {
      for (int x = spans.begin[lane]; x < spans.end[lane]; x += kLanes) {
        // Makes room for the pixels of this step and for the partial pixels of earlier steps.
        if (static_cast<std::size_t>(num_fragments) + 2 * kLanes > fragments_.size()) {
          fragments_.resize(2 * fragments_.size() + 2 * kLanes);
        }
        const unsigned passing =
            first_lanes_mask(spans.end[lane] - x) & passes_occluder_bound_x8(face, &occluder_bounds_[row + x], x, y);
        const unsigned full =
            passing & first_lanes_mask(spans.full_end[lane] - x) & ~first_lanes_mask(spans.full_begin[lane] - x);
        for (unsigned lanes = full; lanes != 0; lanes &= lanes - 1) {
          add(row + x + std::countr_zero(lanes), {1.0f, kAllSamples});
        }
        store_chosen(x, passing & ~full, &partial.x[partial.count]);
        std::fill_n(&partial.y[partial.count], kLanes, y);
        partial.count += std::popcount(passing & ~full);
        if (partial.count >= kLanes) add_partial();
      }
    });
    if (partial.count > 0) add_partial();
    partial.count = 0;
  }
}

// Appends the fragments of a pixel's list to the collected fragments.
void ImageDrawer::collect_fragments(int32_t first) {
  for (int32_t i = first; i >= 0; i = fragments_[i].next) collected_.push_back(fragments_[i]);
}

// Collects the fragments of all pixels with more than one fragment, pixel by pixel, and finds the fragments' visible
// samples.
void ImageDrawer::resolve_occlusion(RowRange rows) {
  collected_.clear();
  visible_.clear();
  pixel_ends_.clear();
  struct Pair {
    std::size_t a, b;  // indices of the fragments
  } pair[kLanes];
  PairsX8 pairs{};
  int num_pairs = 0;
  auto resolve = [&] {
    for (int lane = 0; lane < kLanes; ++lane) {
      const Pair& one = pair[lane < num_pairs ? lane : 0];
      pairs.a[lane] = &faces_[collected_[one.a].face];
      pairs.b[lane] = &faces_[collected_[one.b].face];
    }
    const PairOrder order = order_pairs(pairs);
    for (int lane = 0; lane < num_pairs; ++lane) {
      const PixelCoverage &a = collected_[pair[lane].a].coverage, &b = collected_[pair[lane].b].coverage;
      const bool is_decided = (order.undecided >> lane & 1) == 0 && a.samples != 0 && b.samples != 0;
      const uint64_t shared = pairs.shared[lane], a_first = (order.a_first >> lane & 1) != 0 ? shared : 0;
      const OccludedSamples occluded =
          is_decided ? occluded_samples(a, b, shared, a_first)
                     : occlude_pair(a, b, *pairs.a[lane], *pairs.b[lane], {pairs.x[lane], pairs.y[lane]},
                                    [this](uint32_t solid, uint32_t strip) { return stands(solid, strip); });
      visible_[pair[lane].a] &= ~occluded.of_a;
      visible_[pair[lane].b] &= ~occluded.of_b;
    }
    num_pairs = 0;
  };
  const int width = setting_.camera.width_px;
  for (int y = rows.y_begin; y < rows.y_end; ++y) {
    for (int x = 0; x < width; ++x) {
      const int32_t first = first_fragment_[(y - rows.y_begin) * width + x];
      if (first < 0 || fragments_[first].next < 0) continue;
      const std::size_t begin = collected_.size();
      collect_fragments(first);
      const std::size_t end = collected_.size();
      pixel_ends_.push_back(end);
      for (std::size_t i = begin; i < end; ++i) visible_.push_back(effective_samples(collected_[i].coverage));
      for (std::size_t i = begin; i < end; ++i) {
        const PixelCoverage a = collected_[i].coverage;
        for (std::size_t j = i + 1; j < end; ++j) {
          // There is no branch, because it would often be mispredicted. Instead, the next pair overwrites a pair that
          // shares nothing.
          const uint64_t shared = shared_samples(a, collected_[j].coverage);
          pair[num_pairs] = {i, j};
          pairs.shared[num_pairs] = shared;
          pairs.x[num_pairs] = static_cast<float>(x);
          pairs.y[num_pairs] = static_cast<float>(y);
          num_pairs += shared != 0 ? 1 : 0;
          if (num_pairs == kLanes) resolve();
        }
      }
    }
  }
  if (num_pairs > 0) resolve();
}

template <typename Visit, typename Finish>
void ImageDrawer::composite_rows(RowRange rows, Visit&& visit, Finish&& finish) {
  resolve_occlusion(rows);
  const int num_pixels = (rows.y_end - rows.y_begin) * setting_.camera.width_px;
  std::size_t begin = 0;
  auto next_end = pixel_ends_.begin();
  for (int pixel = 0; pixel < num_pixels; ++pixel) {
    const int32_t first = first_fragment_[pixel];
    if (first < 0) {
      finish(pixel, Rgb{});
      continue;
    }
    const PixelFragment& alone = fragments_[first];
    if (alone.next < 0) {
      const float weight = alone.coverage.area;
      visit(pixel, alone, weight);
      finish(pixel, faces_[alone.face].color * weight);
      continue;
    }
    const std::size_t end = *next_end++;
    divide_remainder([&](auto&& visit_visible) {
      for (std::size_t i = begin; i < end; ++i) visit_visible(collected_[i].coverage, &visible_[i]);
    });
    PixelAccumulator sum;
    weights_.resize(end - begin);
    for (std::size_t i = begin; i < end; ++i) {
      PixelAccumulator::Weight& weight = weights_[i - begin];
      weight = PixelAccumulator::weight_of(collected_[i].coverage, visible_[i]);
      sum.add(weight, faces_[collected_[i].face].color);
    }
    const PixelAccumulator::Shares shares = sum.shares();
    for (std::size_t i = begin; i < end; ++i) visit(pixel, collected_[i], shares.of(weights_[i - begin]));
    finish(pixel, sum.color(shares));
    begin = end;
  }
}

void ImageDrawer::draw(const ImageTarget& target) {
  const int width = setting_.camera.width_px, height = setting_.camera.height_px;
  const int band_rows = max_of(1, min_of(height, kBandPixels / width));
  const bool in_patches = target.order == ChannelOrder::patches;
  // Distance, in values, between the channels of a pixel.
  const int64_t step = in_patches ? place_in_patches(target.patch_px, width, 1, 0, 0) : int64_t{width} * height;
  const bool has_bytes = target.format == PixelFormat::u8 || target.format == PixelFormat::bf16;
  // For formats with the values of bytes, colours are first rounded, because kernels store them as bytes.
  auto shown = [&](Rgb color, int x, int y) {
    return target.effect.of(has_bytes ? rgb_of_bytes(to_bytes(color)) : color, x, y);
  };
  auto draw_as = [&](auto* out, auto&& value_of) {
    // Blackens the parts of patches beyond the image.
    if (in_patches) std::fill_n(out, image_values({width, height}, target.order, target.patch_px), 0);
    for (int y_begin = 0; y_begin < height; y_begin += band_rows) {
      const RowRange rows{y_begin, min_of(height, y_begin + band_rows)};
      make_fragments({0, static_cast<int32_t>(faces_.size())}, rows);
      auto* first = out + int64_t{y_begin} * width;
      composite_rows(
          rows, [](int, const PixelFragment&, float) {},
          [&](int pixel, Rgb color) {
            auto* const to =
                in_patches ? out + place_in_patches(target.patch_px, width, 0, pixel % width, y_begin + pixel / width)
                           : first + pixel;
            if (target.effect.is_on) color = shown(color, pixel % width, y_begin + pixel / width);
            to[0] = value_of(color.r);
            to[step] = value_of(color.g);
            to[2 * step] = value_of(color.b);
          });
    }
  };
  if (target.format == PixelFormat::u8) {
    draw_as(static_cast<uint8_t*>(target.color), [](float channel) { return to_byte(channel); });
  } else if (target.format == PixelFormat::f16) {
    draw_as(static_cast<uint16_t*>(target.color), [](float channel) { return to_half(channel); });
  } else if (target.format == PixelFormat::bf16) {
    draw_as(static_cast<uint16_t*>(target.color), [](float channel) { return bf16_of_byte(to_byte(channel)); });
  } else {
    draw_as(static_cast<float*>(target.color), [](float channel) { return clamp(channel, 0.0f, 1.0f); });
  }
  if (target.depth_m || target.class_id || target.instance_id) draw_planes(target);
}

// Orders the collected fragments of a pixel from front to back. The next fragment is the nearest of those that no
// remaining fragment occludes; in a cycle, it is the nearest fragment.
void ImageDrawer::order_pixel(int x, int y) {
  auto at_centroid = [&](const PixelFragment& fragment) {
    return make_fragment(faces_[fragment.face], fragment.face, fragment.coverage, x, y);
  };
  std::sort(collected_.begin(), collected_.end(), [&](const PixelFragment& a, const PixelFragment& b) {
    return is_nearer(at_centroid(a), at_centroid(b), faces_.data());
  });
  const Vec2 corner{static_cast<float>(x), static_cast<float>(y)};
  auto stands_here = [this](uint32_t solid, uint32_t strip) { return stands(solid, strip); };
  auto occludes = [&](const PixelFragment& other, const PixelFragment& fragment) {
    const uint64_t shared = shared_samples(other.coverage, fragment.coverage);
    const ScreenFace& face = faces_[fragment.face];
    const ScreenFace& other_face = faces_[other.face];
    return shared != 0 && face.object_id != other_face.object_id &&
           is_in_front(other_face, face, corner + centroid_of(shared), stands_here);
  };
  for (auto next = collected_.begin(); next != collected_.end(); ++next) {
    auto is_occluded = [&](const PixelFragment& fragment) {
      return std::any_of(next, collected_.end(), [&](const PixelFragment& other) { return occludes(other, fragment); });
    };
    const auto front = std::find_if_not(next, collected_.end(), is_occluded);
    if (front != collected_.end()) std::rotate(next, front, front + 1);
  }
}

void ImageDrawer::visit_fragments(const std::function<void(int, const PixelCoverage&, Rgb)>& visit) {
  const int width = setting_.camera.width_px, height = setting_.camera.height_px;
  make_fragments({0, static_cast<int32_t>(faces_.size())}, {0, height});
  for (int pixel = 0; pixel < width * height; ++pixel) {
    collected_.clear();
    collect_fragments(first_fragment_[pixel]);
    order_pixel(pixel % width, pixel / width);
    for (const PixelFragment& fragment : collected_) {
      visit(pixel, fragment.coverage, faces_[fragment.face].color);
    }
  }
}

void ImageDrawer::draw_planes(const ImageTarget& target) const {
  const int width = setting_.camera.width_px, height = setting_.camera.height_px;
  std::vector<FrontFace> fronts(static_cast<std::size_t>(width));
  auto add_row = [&](int y, bool is_again) {
    for (const ScreenFace& face : faces_) {
      if (y < face.box.y_begin || y >= face.box.y_end) continue;
      const PolygonEdge* const edges = edges_.at(face.edge_begin);
      const RowSpan span = row_span(edges, face.edge_count, face.box, y);
      for (int x = span.begin; x < span.end; ++x) {
        const Vec2 center = pixel_center(x, y);
        FrontFace& front = fronts[x];
        if (is_again && !front.needs_second_pass()) continue;
        if (!covers_center(edges, face.edge_count, span, x, center)) continue;
        is_again ? front.add_second_pass(face, center) : front.add(face, center);
      }
    }
  };
  for (int y = 0; y < height; ++y) {
    std::fill(fronts.begin(), fronts.end(), FrontFace{});
    add_row(y, /*is_again=*/false);
    add_row(y, /*is_again=*/true);
    for (int x = 0; x < width; ++x) {
      const Vec2 center = pixel_center(x, y);
      const ScreenFace* face =
          fronts[x].front(center, [this](uint32_t solid, uint32_t strip) { return stands(solid, strip); });
      const std::size_t pixel =
          static_cast<std::size_t>(y) * static_cast<std::size_t>(width) + static_cast<std::size_t>(x);
      if (target.depth_m) {
        target.depth_m[pixel] = face ? face_depth_m(*face, center) : std::numeric_limits<float>::infinity();
      }
      if (target.class_id) target.class_id[pixel] = face ? face->class_id : uint8_t{0};
      if (target.instance_id) target.instance_id[pixel] = face ? instance_of(*face) : uint16_t{0};
    }
  }
}

void ImageDrawer::accumulate_visibility(int32_t agent, VisibilitySum* sum_inout) {
  const uint32_t object_id = make_object_id(kAgentKind, agent - world_begin());
  auto is_wanted = [object_id](const ScreenFace& face) { return face.object_id == object_id; };
  const auto begin = std::find_if(faces_.begin(), faces_.end(), is_wanted);
  const auto end = std::find_if_not(begin, faces_.end(), is_wanted);
  const FaceRange wanted{static_cast<int32_t>(begin - faces_.begin()), static_cast<int32_t>(end - faces_.begin())};
  int y_begin = setting_.camera.height_px, y_end = 0;
  for (auto face = begin; face != end; ++face) {
    y_begin = min_of(y_begin, face->box.y_begin);
    y_end = max_of(y_end, face->box.y_end);
  }
  const int band_rows = max_of(1, kBandPixels / setting_.camera.width_px);
  for (; y_begin < y_end; y_begin += band_rows) {
    const RowRange rows{y_begin, min_of(y_end, y_begin + band_rows)};
    auto sum_weights = [&](FaceRange faces) {
      int64_t weight = 0;
      make_fragments(faces, rows);
      composite_rows(
          rows,
          [&](int, const PixelFragment& fragment, float fragment_weight) {
            if (fragment.face >= wanted.begin && fragment.face < wanted.end)
              weight += VisibilitySum::units_of(fragment_weight);
          },
          [](int, Rgb) {});
      return weight;
    };
    sum_inout->among_all += sum_weights({0, static_cast<int32_t>(faces_.size())});
    sum_inout->alone += sum_weights(wanted);
  }
}

}  // namespace pictura
