#include "pictura/backend_cuda/renderer/geometry_table.h"

#include <algorithm>
#include <cstring>

#include "pictura/backend_cuda/renderer/draw_task.h"

namespace pictura::cuda {

namespace {

// Sizes are multiples of this step, so that maps of about the same size can reuse each other's memory.
constexpr std::size_t kSizeStep_bytes = 64 << 10;
constexpr std::size_t kAlignment_bytes = 256;

/// Range of elements in a map's memory.
template <typename T>
struct Slice {
  std::size_t offset_bytes = 0, size = 0;
  Span<const T> in(const std::byte* memory) const { return {reinterpret_cast<const T*>(memory + offset_bytes), size}; }
};

template <typename T>
Slice<T> append(Span<const T> values, std::vector<std::byte>* bytes_inout) {
  static_assert(std::is_trivially_copyable_v<T>);
  const Slice<T> slice{(bytes_inout->size() + kAlignment_bytes - 1) / kAlignment_bytes * kAlignment_bytes,
                       values.size()};
  bytes_inout->resize(slice.offset_bytes + values.size() * sizeof(T));
  if (!values.empty()) std::memcpy(bytes_inout->data() + slice.offset_bytes, values.data(), values.size() * sizeof(T));
  return slice;
}

/// Pieces of one kind, and the places of their arrays in a map's memory.
struct PackedPieces {
  PieceGrid host;
  Slice<int32_t> begin, items;
  Slice<Ball> balls;

  PackedPieces(const PieceGrid& grid, std::vector<std::byte>* bytes_inout)
      : host(grid),
        begin(append(grid.cells.begin, bytes_inout)),
        items(append(grid.cells.items, bytes_inout)),
        balls(append(grid.balls, bytes_inout)) {}
  PieceGrid in(const std::byte* memory) const {
    PieceGrid grid = host;
    grid.cells.begin = begin.in(memory);
    grid.cells.items = items.in(memory);
    grid.balls = balls.in(memory);
    return grid;
  }
};

}  // namespace

bool GeometryTable::Retired::has_passed() const {
  const cudaError_t status = cudaEventQuery(event.get());
  if (status == cudaErrorNotReady) {
    cudaGetLastError();  // clears a status that is not an error
    return false;
  }
  check_cuda(status, "cudaEventQuery");
  return true;
}

void GeometryTable::upload(GeometryHandle handle, const StaticGeometry& geometry, cudaStream_t stream) {
  const auto index = static_cast<std::size_t>(handle);
  if (index >= maps_.size()) grow(std::max(index + 1, 2 * maps_.size()), stream);
  const SortedPieces strips(geometry.strips), walls(geometry.walls);
  const StaticGeometryView host = geometry.view();
  std::vector<std::byte> bytes;
  const auto strip_slice = append(host.strips, &bytes);
  const auto wall_slice = append(host.walls, &bytes);
  const auto head_slice = append(host.heads, &bytes);
  const PackedPieces packed_strips(strips.view(), &bytes), packed_walls(walls.view(), &bytes);

  Map map;
  map.memory = allocate(bytes.size());
  map.pieces = static_cast<int>(host.strips.size() + host.walls.size() + host.heads.size());
  map.heads = static_cast<int>(host.heads.size());
  const std::byte* memory = map.memory.data();
  map.entry = {};
  map.entry.pieces.strips = strip_slice.in(memory);
  map.entry.pieces.walls = wall_slice.in(memory);
  map.entry.pieces.heads = head_slice.in(memory);
  map.entry.pieces.num_signals = geometry.num_signals;
  map.entry.strips = packed_strips.in(memory);
  map.entry.walls = packed_walls.in(memory);
  PICTURA_CUDA(cudaMemcpyAsync(map.memory.data(), bytes.data(), bytes.size(), cudaMemcpyHostToDevice, stream));
  swap_map(index, &map);
  PICTURA_CUDA(cudaMemcpyAsync(table_.data() + index, &maps_[index].entry, sizeof(DeviceGeometry),
                               cudaMemcpyHostToDevice, stream));
  retire(std::move(map.memory), stream);
  PICTURA_CUDA(cudaStreamSynchronize(stream));
}

void GeometryTable::release(GeometryHandle handle, cudaStream_t stream) {
  const auto index = static_cast<std::size_t>(handle);
  if (index >= maps_.size() || !maps_[index].entry.is_held()) return;
  // An entry with all bits set is empty, see is_held().
  PICTURA_CUDA(cudaMemsetAsync(table_.data() + index, 0xFF, sizeof(DeviceGeometry), stream));
  Map released;
  swap_map(index, &released);
  retire(std::move(released.memory), stream);
}

void GeometryTable::swap_map(std::size_t index, Map* map_inout) {
  std::swap(maps_[index], *map_inout);
  const auto update = [&](int Map::* count, int* max_inout) {
    const int gone = map_inout->*count, here = maps_[index].*count;
    if (here < *max_inout && gone < *max_inout) return;
    *max_inout = here;
    if (here >= gone) return;
    // All maps are searched only if the map with the maximum was removed.
    for (const Map& map : maps_) *max_inout = std::max(*max_inout, map.*count);
  };
  update(&Map::pieces, &max_pieces_);
  update(&Map::heads, &max_heads_);
}

void GeometryTable::grow(std::size_t entries, cudaStream_t stream) {
  entries = std::min(entries, static_cast<std::size_t>(kNumGeometryHandles));
  maps_.reserve(entries);
  std::vector<DeviceGeometry> host(entries, empty_entry());
  for (std::size_t i = 0; i < maps_.size(); ++i) host[i] = maps_[i].entry;
  DeviceBuffer<DeviceGeometry> table(entries);
  PICTURA_CUDA(
      cudaMemcpyAsync(table.data(), host.data(), entries * sizeof(DeviceGeometry), cudaMemcpyHostToDevice, stream));
  PICTURA_CUDA(cudaStreamSynchronize(stream));
  maps_.resize(entries);      // cannot fail here; earlier failures leave both members unchanged
  table_ = std::move(table);  // frees the old table, which no work on the stream reads any more
  ++generation_;
}

void GeometryTable::retire(DeviceBuffer<std::byte> memory, cudaStream_t stream) {
  if (memory.size() == 0) return;
  cudaEvent_t event = nullptr;
  PICTURA_CUDA(cudaEventCreateWithFlags(&event, cudaEventDisableTiming));
  retired_.push_back({std::move(memory), {}});
  retired_.back().event.reset(event);
  PICTURA_CUDA(cudaEventRecord(event, stream));
}

DeviceBuffer<std::byte> GeometryTable::allocate(std::size_t bytes) {
  bytes = std::max<std::size_t>(1, (bytes + kSizeStep_bytes - 1) / kSizeStep_bytes) * kSizeStep_bytes;
  auto best = retired_.end();
  std::size_t held_bytes = 0, retired_bytes = 0;
  for (const Map& map : maps_) held_bytes += map.memory.size();
  for (auto each = retired_.begin(); each != retired_.end(); ++each) {
    retired_bytes += each->memory.size();
    const bool fits =
        each->memory.size() >= bytes && (best == retired_.end() || each->memory.size() < best->memory.size());
    if (fits && each->has_passed()) best = each;
  }
  if (best != retired_.end()) {
    DeviceBuffer<std::byte> memory = std::move(best->memory);
    retired_.erase(best);
    return memory;
  }
  // At most as much unused memory is retained as is in use. Freeing memory may wait for the device, and so may
  // allocation.
  if (retired_bytes > held_bytes) std::erase_if(retired_, [](const Retired& each) { return each.has_passed(); });
  return DeviceBuffer<std::byte>(bytes);
}

}  // namespace pictura::cuda
