// Communicator of a run's ranks: sums, maxima and copies of tensors. Every rank gets bit-identical results.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/array.h"
#include "pictura/simulator/totals.h"

namespace pictura {

class Ranks;

/// Collective operations: all ranks must make the same calls in the same order, with contiguous tensors of equal type
/// and size. Types are f32, f64, i32, i64 and u8. Tensors are on the host or on the communicator's device. Results
/// overwrite the tensors; on a GPU no call waits for results. Throws RankLost, naming the rank, if a rank has ended or
/// hangs.
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
  /// Copies rank `root`'s tensor to all ranks.
  virtual void broadcast(const at::Tensor& tensor, int root) = 0;
  /// Counts a step of this rank; called where collective operations are far apart, see Ranks::step(). Every rank must
  /// make equally many of these calls.
  virtual void step() = 0;

  /// Returns the maximum over ranks of a number on the host.
  double max_of(double value);
  /// Returns the bytes of every rank, in the order of ranks. Their sizes may differ.
  std::vector<std::vector<uint8_t>> gather(const std::vector<uint8_t>& bytes);
  /// Returns rank 0's bytes.
  std::string from_first(const std::string& bytes);
};

/// Returns the totals of the simulators of all ranks.
SimulatorTotals totals_of_all(SimulatorTotals own, Communicator* communicator);

/// Returns the communicator of a single process. It exists as long as the process.
Communicator* single_communicator();

/// Creates the communicator of these ranks. A single rank uses single_communicator(). Several ranks use Gloo if they
/// learn on hosts, or NCCL if they learn on CUDA devices, each on its own device. Throws Error if this build or this
/// machine lacks the library. `ranks` must outlive the result.
std::unique_ptr<Communicator> make_communicator(Ranks* ranks, Device device);

/// Creates a Gloo or NCCL communicator of any number of ranks.
std::unique_ptr<Communicator> make_gloo_communicator(Ranks* ranks);
std::unique_ptr<Communicator> make_nccl_communicator(Ranks* ranks, Device device);

}  // namespace pictura
