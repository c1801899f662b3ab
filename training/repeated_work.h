// Work of the learner that is repeated over the same memory. On a CUDA device it is captured into a graph, which one
// call launches: networks of a few thousand agents are so quick that their kernels wait for the host.
#pragma once

#include <functional>
#include <memory>

#include "pictura/common/device.h"
#include "pictura/training/rules/device_graph.h"

namespace pictura {

/// Memory of the tensors that graphs make while they are captured, where no other tensor comes to lie. Graphs share it:
/// they are launched one after the other, and what has to outlast one is held by a tensor.
class GraphMemory {
 public:
  explicit GraphMemory(Device device) : device_(device) {}
  ~GraphMemory();
  GraphMemory(const GraphMemory&) = delete;
  GraphMemory& operator=(const GraphMemory&) = delete;

  /// Calls `work`, whose tensors on the stream are allocated there.
  void serve(Stream stream, const std::function<void()>& work);
  /// Releases what torch keeps for later tensors outside of it, which it cannot do while work is captured.
  void make_room() const;
  /// Releases the memory once no tensor lies there any more. No graph may be launched that was captured before.
  void release();

 private:
  const Device device_;
  uint64_t id_ = 0;  // torch's, of this memory; 0 before the first use
  int uses_ = 0;
};

/// Graphs of one device: whether work is captured, and the memory that the graphs share.
class Graphs {
 public:
  Graphs(Device device, bool are_used) : device_(device), are_used_(are_used), memory_(device) {}

  bool are_used() const { return are_used_; }
  /// Graph of what `work` puts on torch's current stream, which must be none that waits for others. Throws Error naming
  /// the key where that cannot be captured; c10::OutOfMemoryError.
  std::unique_ptr<DeviceGraph> capture(const std::function<void()>& work);
  void launch(DeviceGraph* graph);
  /// Must be called before work is captured that takes much memory.
  void make_room() const { memory_.make_room(); }
  /// Releases the memory of graphs once none is left.
  void release_memory() { memory_.release(); }

  /// Graphs that have been launched so far.
  int64_t num_launches() const { return num_launches_; }

 private:
  const Device device_;
  const bool are_used_;
  GraphMemory memory_;
  int64_t num_launches_ = 0;
};

/// Piece of work that is done call by call the first time, which loads and chooses all that it needs, captured the
/// second time, and launched as a graph from then on.
class RepeatedWork {
 public:
  enum class Mode { calls, capture, launch };
  /// How the work is done next. `is_settled`: the memory that it works on will be the same from now on.
  Mode next_mode(const Graphs& graphs, bool is_settled);
  /// Does the work. Work that is captured or launched must wait for nothing, and do the same whenever it is done.
  void run(Mode mode, Graphs* graphs, const std::function<void()>& work);
  void run(Graphs* graphs, const std::function<void()>& work) { run(next_mode(*graphs, true), graphs, work); }

  bool is_captured() const { return graph_ != nullptr; }

 private:
  bool is_warm_ = false;
  std::unique_ptr<DeviceGraph> graph_;
};

}  // namespace pictura
