// Muon (Jordan et al., 2024), an optimizer for the weights of hidden layers. It makes the momentum of each weight
// matrix orthogonal before each step. Steps are scaled as in Liu et al., "Muon is scalable for LLM training" (2025), so
// that AdamW's learning rates and weight decay apply unchanged.
#pragma once

#include <vector>

#include "pictura/policy/policy.h"
#include "pictura/training/repeated_work.h"

namespace pictura {

/// Returns whether Muon updates a parameter. Muon updates the weights of hidden layers. AdamW updates biases, norms,
/// queries, layers that read positions or pixels, and the two heads.
bool is_stepped_by_muon(const NamedTensor& parameter);

/// Root mean squares of the weights for which is_stepped_by_muon() is true, also in runs without Muon. all: over all
/// these weights. largest: maximum over matrices. Both are 0 without such weights.
struct WeightRms {
  double all = 0, largest = 0;
};
/// Returns the root mean squares of these parameters. Waits for their device.
WeightRms weight_rms(const std::vector<NamedTensor>& parameters);

/// Returns matrices [n, rows, columns] with the singular vectors of `matrices` and singular values near 1. Computes
/// them by five Newton-Schulz steps in `type`. Singular values of at least 1/200 of the Frobenius norm become 0.7 to
/// 1.2. A zero matrix stays zero.
at::Tensor orthogonalized(const at::Tensor& matrices, at::ScalarType type);

class Muon {
 public:
  /// Creates the optimizer. weights: f32 leaves with gradients, [out, ...], on `device`; each is stepped as the matrix
  /// [out, rest]. type: data type of matrix products. uses_graphs: whether each step is launched as one CUDA graph; the
  /// current stream must then be one that can be captured.
  Muon(std::vector<at::Tensor> weights, at::ScalarType type, double weight_decay, Device device = {},
       bool uses_graphs = false);

  /// Takes one step along the weights' gradients. failed: f32 scalar; if it is not 0, neither weights nor momentum
  /// change, whatever the gradients are. Does not wait for the device.
  void step(double learning_rate, const at::Tensor& failed);
  /// Discards the captured graph. Must be called if the addresses of gradients change.
  void discard_graph();

  /// Returns the momentum of weight i, in the shape of the weight.
  at::Tensor momentum(size_t i) const { return parts_of(momentum_)[i]; }

 private:
  // Matrices that are multiplied in one batch: padded with zeros to one size, and transposed if they are taller than
  // wide.
  struct Batch {
    int64_t rows = 0, columns = 0;
    std::vector<size_t> weights;
    double cost() const;
  };
  void take_step();
  static std::vector<Batch> make_batches(const std::vector<at::Tensor>& weights);
  void index_batches();
  // Splits a vector of all weights' elements into tensors of the weights' shapes.
  std::vector<at::Tensor> parts_of(const at::Tensor& flat) const;

  std::vector<at::Tensor> weights_;
  const at::ScalarType type_;
  const double weight_decay_;
  at::Tensor momentum_;  // [elements of all weights]
  std::vector<Batch> batches_;
  // Index of each batch element in a vector of all weights' elements (for padding, the vector's size), and the inverse
  // mapping.
  at::Tensor element_of_place_, place_of_element_;
  std::vector<at::Tensor> scales_;  // [batches], each [weights, 1, 1]: factors of the weights' steps
  at::Tensor rate_, failed_;        // f32 scalars of this step
  Graphs graphs_;
  RepeatedWork step_;
};

}  // namespace pictura
