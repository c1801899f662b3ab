// Repeated work of the learner on the same memory. Small networks would wait for launches by the host, so CUDA devices
// run captured graphs.
#pragma once

#include <functional>
#include <memory>

#include "pictura/common/device.h"
#include "pictura/training/rules/device_graph.h"

namespace pictura {

/// Memory of tensors that are created during capture. All graphs share it, because they run one after the other. Keep
/// each result's tensor if it is used after another graph's launch; otherwise the other graph may reuse its memory.
class GraphMemory {
 public:
  explicit GraphMemory(Device device) : device_(device) {}
  ~GraphMemory();
  GraphMemory(const GraphMemory&) = delete;
  GraphMemory& operator=(const GraphMemory&) = delete;

  /// Calls `work`, whose tensors on the stream use this memory.
  void allocate_within(Stream stream, const std::function<void()>& work);
  /// Releases torch's other cached memory, which torch cannot do during capture.
  void release_cached_memory() const;
  /// Releases the memory once it holds no tensor. No earlier graph may be launched afterwards.
  void release();

 private:
  const Device device_;
  uint64_t id_ = 0;  // torch's id; 0 before the first use
  int uses_ = 0;
};

/// Graphs of one device.
class Graphs {
 public:
  Graphs(Device device, bool are_used) : device_(device), are_used_(are_used), memory_(device) {}

  bool are_used() const { return are_used_; }
  /// Captures the work that `work` enqueues on torch's current stream, which must not be the default stream. Throws
  /// Error naming train.graphs if capture fails, and c10::OutOfMemoryError if memory is too small.
  std::unique_ptr<DeviceGraph> capture(const std::function<void()>& work);
  void launch(DeviceGraph* graph);
  /// Call it before capturing work that needs much memory.
  void release_cached_memory() const { memory_.release_cached_memory(); }
  /// Call it once no graph exists.
  void release_memory() { memory_.release(); }

  int64_t num_launches() const { return num_launches_; }

 private:
  const Device device_;
  const bool are_used_;
  GraphMemory memory_;
  int64_t num_launches_ = 0;
};

/// Work that is executed repeatedly: first call by call, then captured as a graph, then launched.
class RepeatedWork {
 public:
  enum class Mode { calls, capture, launch };
  /// Returns the mode of the next execution. is_settled: the work's memory keeps its addresses from now on.
  Mode next_mode(const Graphs& graphs, bool is_settled);
  /// Executes the work. Captured work must not wait, and must do the same each time.
  void run(Mode mode, Graphs* graphs, const std::function<void()>& work);
  void run(Graphs* graphs, const std::function<void()>& work) { run(next_mode(*graphs, true), graphs, work); }

  bool is_captured() const { return graph_ != nullptr; }

 private:
  bool is_warm_ = false;
  std::unique_ptr<DeviceGraph> graph_;
};

}  // namespace pictura
