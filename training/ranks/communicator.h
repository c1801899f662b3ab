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
/// size: f32, f64, i32, i64 or u8, on the host or on the communicator's device. Results are in place; on a device
/// nothing waits for them. Throws RankLost, naming the rank, where one has ended or hangs.
class Communicator {
 public:
  virtual ~Communicator() = default;
  Communicator() = default;
  Communicator(const Communicator&) = delete;
  Communicator& operator=(const Communicator&) = delete;

  /// "null", "gloo" or "nccl".
  virtual std::string name() const = 0;
  virtual int rank() const = 0;
  virtual int size() const = 0;
  bool is_first() const { return rank() == 0; }

  virtual void sum(const at::Tensor& tensor) = 0;
  virtual void max(const at::Tensor& tensor) = 0;
  /// Copies rank `root`'s tensor to all.
  virtual void broadcast(const at::Tensor& tensor, int root) = 0;
  /// Heartbeat of this rank between calls that are far apart, as many on every rank.
  virtual void step() = 0;

  /// Maximum of numbers on the host.
  double max_of(double value);
  /// Bytes of every rank, which may differ in number, in order of ranks.
  std::vector<std::vector<uint8_t>> gather(const std::vector<uint8_t>& bytes);
  /// Rank 0's bytes.
  std::string from_first(const std::string& bytes);
};

/// Totals of the simulators of all ranks.
SimulatorTotals totals_of_all(SimulatorTotals own, Communicator* communicator);

/// Communicator of one process alone, which lives as long as the process.
Communicator* alone();

/// Communicator of these ranks: alone(), NCCL where they learn on CUDA devices, one each, or Gloo. Throws Error where
/// this build or this machine lacks what that needs. `ranks` must outlive it.
std::unique_ptr<Communicator> make_communicator(Ranks* ranks, Device device);

/// Communicator through Gloo or NCCL, of any number of ranks.
std::unique_ptr<Communicator> make_gloo_communicator(Ranks* ranks);
std::unique_ptr<Communicator> make_nccl_communicator(Ranks* ranks, Device device);

}  // namespace pictura
