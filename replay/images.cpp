#include "pictura/replay/images.h"

#include <cstdlib>

#include "pictura/replay/encoding.h"

namespace pictura {

namespace {

// How a row is predicted, the byte before it. Differences are modulo 256.
enum class RowFilter : uint8_t { left, above, gradient, before };
constexpr int kNumRowFilters = 4;
constexpr size_t kChannels = 3;

struct Rows {
  const uint8_t* row;
  const uint8_t* above;   // or null
  const uint8_t* before;  // the same row of the frame before, or null
  size_t size;

  uint8_t predict(RowFilter filter, size_t i) const {
    const int left = i >= kChannels ? row[i - kChannels] : 0, up = above ? above[i] : 0;
    switch (filter) {
      case RowFilter::left: return static_cast<uint8_t>(left);
      case RowFilter::above: return static_cast<uint8_t>(up);
      case RowFilter::before: return before ? before[i] : 0;
      default: break;
    }
    const int corner = above && i >= kChannels ? above[i - kChannels] : 0;
    const int low = std::min(left, up), high = std::max(left, up);
    return static_cast<uint8_t>(corner >= high ? low : corner <= low ? high : left + up - corner);
  }
};

/// Calls visit(rows, offset of the row in all frames) for every row of every camera of every frame.
template <typename Visit>
void for_each_row(const std::vector<ReplayCamera>& cameras, const uint8_t* first, size_t num_frames, Visit&& visit) {
  const size_t frame_bytes = bytes_of_frame(cameras);
  for (size_t frame = 0; frame < num_frames; ++frame) {
    size_t offset = frame * frame_bytes;
    for (const ReplayCamera& camera : cameras) {
      const size_t size = static_cast<size_t>(camera.width_px) * kChannels;
      for (int32_t y = 0; y < camera.height_px; ++y, offset += size) {
        const uint8_t* row = first + offset;
        visit(Rows{row, y > 0 ? row - size : nullptr, frame > 0 ? row - frame_bytes : nullptr, size}, offset);
      }
    }
  }
}

}  // namespace

size_t bytes_of_frame(const std::vector<ReplayCamera>& cameras) {
  size_t bytes = 0;
  for (const ReplayCamera& camera : cameras) {
    bytes += static_cast<size_t>(camera.width_px) * static_cast<size_t>(camera.height_px) * kChannels;
  }
  return bytes;
}

std::string pack_images(const std::vector<ReplayCamera>& cameras, std::string_view frames) {
  std::string packed;
  for_each_row(cameras, reinterpret_cast<const uint8_t*>(frames.data()), frames.size() / bytes_of_frame(cameras),
               [&packed](const Rows& rows, size_t) {
                 RowFilter best = RowFilter::left;
                 size_t least = SIZE_MAX;
                 for (int f = 0; f < kNumRowFilters; ++f) {
                   const auto filter = static_cast<RowFilter>(f);
                   size_t cost = 0;
                   for (size_t i = 0; i < rows.size; ++i) {
                     cost += rows.row[i] != rows.predict(filter, i);
                   }
                   if (cost < least) {
                     least = cost;
                     best = filter;
                   }
                 }
                 packed.push_back(static_cast<char>(best));
                 for (size_t i = 0; i < rows.size; ++i) {
                   packed.push_back(static_cast<char>(rows.row[i] - rows.predict(best, i)));
                 }
               });
  return deflate(packed);
}

std::string unpack_images(const std::vector<ReplayCamera>& cameras, std::string_view group, int count) {
  size_t num_rows = 0;
  for (const ReplayCamera& camera : cameras) num_rows += static_cast<size_t>(camera.height_px);
  const auto num_frames = static_cast<size_t>(count);
  std::string frames(bytes_of_frame(cameras) * num_frames, '\0');
  const std::string packed = inflate(group, frames.size() + num_rows * num_frames);
  auto* const first = reinterpret_cast<uint8_t*>(frames.data());
  size_t at = 0;
  for_each_row(cameras, first, num_frames, [&](const Rows& rows, size_t offset) {
    const auto filter = static_cast<uint8_t>(packed[at++]);
    PICTURA_CHECK(filter < kNumRowFilters, "images: expected a row's filter of 0 to {}, got {}", kNumRowFilters - 1,
                  filter);
    for (size_t i = 0; i < rows.size; ++i) {
      first[offset + i] =
          static_cast<uint8_t>(static_cast<uint8_t>(packed[at++]) + rows.predict(static_cast<RowFilter>(filter), i));
    }
  });
  return frames;
}

}  // namespace pictura
