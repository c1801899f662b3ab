// Communicator of a run's ranks: sums, maxima and copies of tensors. Every rank gets the same bits.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/array.h"
#include "pictura/simulator/totals.h"

namespace pictura {

class Ranks;

/// Collective operations: all ranks make the same calls in the same order, with contiguous tensors of equal type and
/// size: f32, f64, i32, i64 or u8, on the host or on the communicator's device. Results are in place; on a device no
/// call waits for them. Throws RankLost, naming the rank, if a rank has ended or hangs.
class Communicator {
 public:
  virtual ~Communicator() = default;
  Communicator() = default;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  /// Name of the implementation: "null", "gloo" or "nccl".
  virtual std::string name() const = 0;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  bool is_first() const { return rank() == 0; }

  virtual void sum(const at::Tensor& tensor) = 0;
  virtual void max(const at::Tensor& tensor) = 0;
  /// Copies rank `root`'s tensor to all.
  virtual void broadcast(const at::Tensor& tensor, int root) = 0;
  /// Heartbeat of this rank between calls that are far apart. Every rank must send the same number.
  virtual void step() = 0;

  /// Maximum of numbers on the host.
  double max_of(double value);
  /// Gathers the bytes of every rank, whose sizes may differ, in the order of ranks.
  std::vector<std::vector<uint8_t>> gather(const std::vector<uint8_t>& bytes);
  /// Returns rank 0's bytes.
  std::string from_first(const std::string& bytes);
};

/// Totals of the simulators of all ranks.
SimulatorTotals totals_of_all(SimulatorTotals own, Communicator* communicator);

/// Communicator of a single process, which lives as long as the process.
Communicator* single_communicator();

/// Creates the communicator of these ranks: single_communicator(), NCCL if they learn on CUDA devices, one each, or
/// Gloo. Throws Error if this build or this machine lacks the library. `ranks` must outlive it.
std::unique_ptr<Communicator> make_communicator(Ranks* ranks, Device device);

/// Creates a Gloo or NCCL communicator of any number of ranks.
std::unique_ptr<Communicator> make_gloo_communicator(Ranks* ranks);
std::unique_ptr<Communicator> make_nccl_communicator(Ranks* ranks, Device device);

}  // namespace pictura
