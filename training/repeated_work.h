// Repeated work of the learner on the same memory. On a CUDA device the work is captured into a graph, which one call
// launches. With a few thousand agents, a network's kernels are so fast that they would otherwise wait for launches by
// the host.
#pragma once

#include <functional>
#include <memory>

#include "pictura/common/device.h"
#include "pictura/training/rules/device_graph.h"

namespace pictura {

/// Memory of the tensors that are created during graph capture; no other tensor is allocated there. Graphs share the
/// memory, because they are launched one after the other. A result that is used after another graph's launch must be
/// held by a tensor.
class GraphMemory {
 public:
  explicit GraphMemory(Device device) : device_(device) {}
  ~GraphMemory();
  GraphMemory(const GraphMemory&) = delete;
  GraphMemory& operator=(const GraphMemory&) = delete;

  /// Calls `work`, whose tensors on the stream are allocated in this memory.
  void allocate_within(Stream stream, const std::function<void()>& work);
  /// Releases torch's other cached memory; torch cannot do so during capture.
  void release_cached_memory() const;
  /// Releases the memory once it holds no tensor. Graphs captured before must not be launched any more.
  void release();

 private:
  const Device device_;
  uint64_t id_ = 0;  // torch's id of this memory; 0 before the first use
  int uses_ = 0;
};

/// Graphs of one device: whether work is captured, and the memory shared by the graphs.
class Graphs {
 public:
  Graphs(Device device, bool are_used) : device_(device), are_used_(are_used), memory_(device) {}

  bool are_used() const { return are_used_; }
  /// Captures a graph of the work that `work` enqueues on torch's current stream. This stream must not be the default
  /// stream, which waits for other streams. Throws Error naming train.graphs if the work cannot be captured, and
  /// c10::OutOfMemoryError if memory is too small.
  std::unique_ptr<DeviceGraph> capture(const std::function<void()>& work);
  void launch(DeviceGraph* graph);
  /// Frees memory. Must be called before capturing work that needs much memory.
  void release_cached_memory() const { memory_.release_cached_memory(); }
  /// Releases the memory of graphs once no graph exists.
  void release_memory() { memory_.release(); }

  /// Number of graphs launched so far.
  int64_t num_launches() const { return num_launches_; }

 private:
  const Device device_;
  const bool are_used_;
  GraphMemory memory_;
  int64_t num_launches_ = 0;
};

/// Work that is executed repeatedly. The first execution runs call by call, which loads and selects everything that the
/// work needs. The second execution is captured into a graph. Later executions launch this graph.
class RepeatedWork {
 public:
  enum class Mode { calls, capture, launch };
  /// Returns the mode of the next execution. `is_settled`: whether the work's memory keeps its addresses from now on.
  Mode next_mode(const Graphs& graphs, bool is_settled);
  /// Executes the work. Captured or launched work must not wait, and must do the same in every execution.
  void run(Mode mode, Graphs* graphs, const std::function<void()>& work);
  void run(Graphs* graphs, const std::function<void()>& work) { run(next_mode(*graphs, true), graphs, work); }

  bool is_captured() const { return graph_ != nullptr; }

 private:
  bool is_warm_ = false;
  std::unique_ptr<DeviceGraph> graph_;
};

}  // namespace pictura
