// What the ranks of a run compute together: sums, maxima and copies of tensors. Every rank gets the same bits.
#pragma once

#include <memory>
#include <string>
#include <vector>

#include <ATen/ATen.h>

#include "pictura/common/array.h"
#include "pictura/simulator/totals.h"

namespace pictura {

class Ranks;

/// All ranks make the same calls in the same order, with tensors without gaps of equal type and size: f32, f64, i32,
/// i64 or u8, on the host or on the communicator's device. Results are in place; on a device nothing waits for them.
/// Throws RankLost, naming it, where a rank has ended or hangs.
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
  /// From rank `root` to all.
  virtual void broadcast(const at::Tensor& tensor, int root) = 0;
  /// A sign that this rank goes on, between calls that are far apart: as many of all ranks.
  virtual void step() = 0;

  /// Of single numbers on the host.
  double max_of(double value);
  /// The bytes of every rank, which may differ in number, in order of ranks.
  std::vector<std::vector<uint8_t>> gather(const std::vector<uint8_t>& bytes);
  /// Rank 0's bytes.
  std::string from_first(const std::string& bytes);
};

/// What the simulators of all ranks have counted.
SimulatorTotals totals_of_all(SimulatorTotals own, Communicator* communicator);

/// Of one process alone: nothing is sent. It lives as long as the process.
Communicator* alone();

/// How these ranks compute together: alone, through NCCL where they learn on CUDA devices, one each, or through Gloo.
/// Throws Error where this build or this machine lacks what that needs. `ranks` must outlive it.
std::unique_ptr<Communicator> make_communicator(Ranks* ranks, Device device);

/// These in particular. A single rank may have one too.
std::unique_ptr<Communicator> make_gloo_communicator(Ranks* ranks);
std::unique_ptr<Communicator> make_nccl_communicator(Ranks* ranks, Device device);

}  // namespace pictura
