// A renderer's maps in device memory, indexed by handle.
#pragma once

#include <memory>
#include <type_traits>
#include <vector>

#include "pictura/backend_cuda/renderer/kernel_arguments.h"
#include "pictura/common/cuda/device_buffer.h"
#include "pictura/common/scene.h"

namespace pictura::cuda {

/// Table of maps. Callers make its device current and check the handles. Memory of a replaced or released map is reused
/// after the stream has completed all earlier work.
class GeometryTable {
 public:
  /// Copies an empty table to the device on the default stream.
  GeometryTable() { grow(kMinEntries, nullptr); }

  /// Writes a map and its entry, and waits for the stream. Then no kernel reads the replaced map, and the caller may
  /// free `geometry`.
  void upload(GeometryHandle handle, const StaticGeometry& geometry, cudaStream_t stream);
  /// Empties an entry, on the stream.
  void release(GeometryHandle handle, cudaStream_t stream);

  const DeviceGeometry* entries() const { return table_.data(); }
  int32_t num_entries() const { return static_cast<int32_t>(maps_.size()); }
  /// Number of times that the table's address has changed.
  uint64_t generation() const { return generation_; }
  /// Maxima over all held maps.
  int max_pieces() const { return max_pieces_; }
  int max_heads() const { return max_heads_; }

 private:
  static constexpr std::size_t kMinEntries = 16;

  struct Map {
    DeviceBuffer<std::byte> memory;
    int pieces = 0, heads = 0;
    DeviceGeometry entry = empty_entry();
  };
  struct DestroyEvent {
    void operator()(cudaEvent_t event) const { cudaEventDestroy(event); }
  };
  /// Memory that the device no longer uses after the event.
  struct Retired {
    DeviceBuffer<std::byte> memory;
    std::unique_ptr<std::remove_pointer_t<cudaEvent_t>, DestroyEvent> event;
    bool has_passed() const;
  };

  void grow(std::size_t entries, cudaStream_t stream);
  void swap_map(std::size_t index, Map* map_inout);
  void retire(DeviceBuffer<std::byte> memory, cudaStream_t stream);
  DeviceBuffer<std::byte> allocate(std::size_t bytes);

  std::vector<Map> maps_;  // [handle]
  DeviceBuffer<DeviceGeometry> table_;
  std::vector<Retired> retired_;
  int max_pieces_ = 0, max_heads_ = 0;  // cached for drawing calls
  uint64_t generation_ = 0;
};

}  // namespace pictura::cuda
