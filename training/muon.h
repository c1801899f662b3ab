// Muon (Jordan et al., 2024), an optimizer that makes the momentum of each weight matrix orthogonal. Steps are scaled
// to fit AdamW's learning rates and weight decay (Liu et al., "Muon is scalable for LLM training", 2025).
#pragma once

#include <vector>

#include "pictura/policy/policy.h"
#include "pictura/training/repeated_work.h"

namespace pictura {

/// Whether Muon updates a parameter: true for weights of hidden layers. AdamW updates biases, norms, queries, layers
/// that read positions or pixels, and heads.
bool is_stepped_by_muon(const NamedTensor& parameter);

/// Root mean squares of the weights that is_stepped_by_muon() selects: over all, and the maximum over matrices. Both
/// are 0 without such weights.
struct WeightRms {
  double all = 0, largest = 0;
};
/// Waits for the parameters' device.
WeightRms weight_rms(const std::vector<NamedTensor>& parameters);

/// Returns matrices [n, rows, columns] with the singular vectors of `matrices` and singular values near 1. Uses five
/// Newton-Schulz steps in `type`. Singular values of at least 1/200 of the Frobenius norm become 0.7 to 1.2; zero
/// matrices stay zero.
at::Tensor orthogonalized(const at::Tensor& matrices, at::ScalarType type);

class Muon {
 public:
  /// weights: f32 leaves with gradients, [out, ...], treated as matrices [out, rest]. type: type of matrix products.
  /// uses_graphs: captures steps; the current stream must then not be the default stream.
  Muon(std::vector<at::Tensor> weights, at::ScalarType type, double weight_decay, Device device = {},
       bool uses_graphs = false);

  /// Takes one step without waiting for the device. failed: f32 scalar; if it is not 0, nothing changes.
  void step(double learning_rate, const at::Tensor& failed);
  /// Call it after gradients move in memory.
  void discard_graph();

  /// Momentum of weight i, shaped like the weight.
  at::Tensor momentum(size_t i) const { return parts_of(momentum_)[i]; }

 private:
  // Matrices for one batched product: padded with zeros, and transposed if taller than wide.
  struct Batch {
    int64_t rows = 0, columns = 0;
    std::vector<size_t> weights;
    double cost() const;
  };
  void take_step();
  static std::vector<Batch> make_batches(const std::vector<at::Tensor>& weights);
  void index_batches();
  std::vector<at::Tensor> parts_of(const at::Tensor& flat) const;

  std::vector<at::Tensor> weights_;
  const at::ScalarType type_;
  const double weight_decay_;
  at::Tensor momentum_;  // [elements of all weights]
  std::vector<Batch> batches_;
  // Index in momentum_ of each batch element (for padding: the size of momentum_), and the inverse.
  at::Tensor element_of_place_, place_of_element_;
  std::vector<at::Tensor> scales_;  // [batches], each [weights, 1, 1]: factors of steps
  at::Tensor rate_, failed_;
  Graphs graphs_;
  RepeatedWork step_;
};

}  // namespace pictura
