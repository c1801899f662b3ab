// Communicator of a run's ranks.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/array.h"
#include "pictura/simulator/totals.h"

namespace pictura {

class Ranks;

/// Collective operations with bit-identical results on every rank. All ranks must make the same calls in the same
/// order. Tensors must be contiguous, of equal size and type (f32, f64, i32, i64 or u8), on the host or the
/// communicator's device. Results overwrite them; on a GPU no call waits for results. Throws RankLost, naming the rank,
/// if a rank has ended or hangs.
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
  /// Counts a step, see Ranks::step(). Call it where collective operations are far apart.
  virtual void step() = 0;

  double max_of(double value);
  /// Returns every rank's bytes, in the order of ranks; sizes may differ.
  std::vector<std::vector<uint8_t>> gather(const std::vector<uint8_t>& bytes);
  std::string from_first(const std::string& bytes);
};

/// Sums the simulators' totals over ranks.
SimulatorTotals totals_of_all(SimulatorTotals own, Communicator* communicator);

/// Communicator of a single process.
Communicator* single_communicator();

/// Creates a communicator (Gloo on hosts, NCCL on CUDA devices, one device per rank) of these ranks, which must outlive
/// it. Throws Error if this build or machine lacks the library.
std::unique_ptr<Communicator> make_communicator(Ranks* ranks, Device device);

/// Create Gloo's or NCCL's communicator, even of a single rank.
std::unique_ptr<Communicator> make_gloo_communicator(Ranks* ranks);
std::unique_ptr<Communicator> make_nccl_communicator(Ranks* ranks, Device device);

}  // namespace pictura
