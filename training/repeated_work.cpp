#include "pictura/training/repeated_work.h"

#include <utility>

#include <c10/util/Exception.h>

#include "pictura/backends/make_learner.h"
#include "pictura/common/error.h"
#include "pictura/policy/torch_device.h"

namespace pictura {

std::unique_ptr<DeviceGraph> Graphs::capture(const std::function<void()>& work) {
  const Stream stream = current_stream(device_);
  std::unique_ptr<DeviceGraph> graph;
  try {
    memory_.allocate_within(stream, [&] { graph = capture_graph(device_, stream, work); });
  } catch (const c10::OutOfMemoryError&) {
    throw;
  } catch (const std::exception& error) {
    fail("train: work could not be captured into a CUDA graph (train.graphs = \"off\" uses no graphs): {}",
         error.what());
  }
  return graph;
}

void Graphs::launch(DeviceGraph* graph) {
  graph->launch(current_stream(device_));
  ++num_launches_;
}

RepeatedWork::Mode RepeatedWork::next_mode(const Graphs& graphs, bool is_settled) {
  if (!graphs.are_used() || !is_settled) return Mode::calls;
  if (graph_) return Mode::launch;
  return std::exchange(is_warm_, true) ? Mode::capture : Mode::calls;
}

void RepeatedWork::run(Mode mode, Graphs* graphs, const std::function<void()>& work) {
  if (mode == Mode::calls) return work();
  if (mode == Mode::capture) graph_ = graphs->capture(work);
  graphs->launch(graph_.get());
}

}  // namespace pictura
