#include "pictura/training/muon.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include <ATen/core/grad_mode.h>

namespace pictura {

namespace {

constexpr double kMomentum = 0.95;

// Root mean square of a step's elements, divided by the learning rate. It is about that of AdamW's steps.
constexpr double kStepRms = 0.2;

int64_t rows_of(const at::Tensor& weight) { return weight.size(0); }
int64_t columns_of(const at::Tensor& weight) { return weight.numel() / weight.size(0); }

}  // namespace

bool is_stepped_by_muon(const NamedTensor& parameter) {
  if (parameter.value.dim() < 2 || !parameter.name.ends_with(".weight")) return false;
  constexpr const char* kOfAdamW[] = {"conv.0.", "attention.position.", "actor.", "critic."};
  return std::none_of(std::begin(kOfAdamW), std::end(kOfAdamW),
                      [&](const char* layer) { return parameter.name.starts_with(layer); });
}

WeightRms weight_rms(const std::vector<NamedTensor>& parameters) {
  const at::NoGradGuard no_grad;
  std::vector<at::Tensor> weights;
  for (const NamedTensor& parameter : parameters) {
    if (is_stepped_by_muon(parameter)) weights.push_back(parameter.value);
  }
  if (weights.empty()) return {};
  const at::Tensor norms = at::stack(at::_foreach_norm(weights)).cpu().to(at::kDouble);
  double squares = 0, elements = 0;
  WeightRms rms;
  for (size_t i = 0; i < weights.size(); ++i) {
    const double norm = norms[static_cast<int64_t>(i)].item<double>(), its_elements = double(weights[i].numel());
    squares += norm * norm;
    elements += its_elements;
    rms.largest = std::max(rms.largest, norm / std::sqrt(its_elements));
  }
  rms.all = std::sqrt(squares / elements);
  return rms;
}

at::Tensor orthogonalized(const at::Tensor& matrices, at::ScalarType type) {
  const at::Tensor norms = at::linalg_vector_norm(matrices, 2, at::IntArrayRef{1, 2}, /*keepdim=*/true);
  at::Tensor x = (matrices / norms.clamp_min(std::numeric_limits<float>::min())).to(type);
  // Jordan's quintic polynomial. Its slope at 0 is steep. Repeated application maps (0, 1] near 1 but does not converge
  // to 1.
  constexpr int kSteps = 5;
  constexpr double kLinear = 3.4445, kCubic = -4.775, kQuintic = 2.0315;
  for (int step = 0; step < kSteps; ++step) {
    const at::Tensor gram = x.bmm(x.transpose(1, 2));
    x = at::baddbmm(x, at::baddbmm(gram, gram, gram, kCubic, kQuintic), x, kLinear, 1);
  }
  return x.to(matrices.scalar_type());
}

Muon::Muon(std::vector<at::Tensor> weights, at::ScalarType type, double weight_decay, Device device, bool uses_graphs)
    : weights_(std::move(weights)),
      type_(type),
      weight_decay_(weight_decay),
      batches_(make_batches(weights_)),
      graphs_(device, uses_graphs) {
  int64_t num_elements = 0;
  for (const at::Tensor& weight : weights_) num_elements += weight.numel();
  momentum_ = at::zeros({num_elements}, weights_.front().options().requires_grad(false));
  rate_ = at::zeros({}, momentum_.options());
  failed_ = at::zeros({}, momentum_.options());
  index_batches();
}

// Returns the number of multiplications of the products, plus the overhead of launches in units of multiplications.
// This cost makes small matrices share a launch, and large matrices get little padding.
double Muon::Batch::cost() const {
  constexpr double kLaunches = 3e8;
  const auto side = static_cast<double>(rows);
  return kLaunches + static_cast<double>(weights.size()) * side * side * (2 * static_cast<double>(columns) + side);
}

std::vector<Muon::Batch> Muon::make_batches(const std::vector<at::Tensor>& weights) {
  std::vector<Batch> batches;
  for (size_t i = 0; i < weights.size(); ++i) {
    const int64_t rows = rows_of(weights[i]), columns = columns_of(weights[i]);
    batches.push_back({std::min(rows, columns), std::max(rows, columns), {i}});
  }
  const auto joined = [](const Batch& a, const Batch& b) {
    Batch both{std::max(a.rows, b.rows), std::max(a.columns, b.columns), a.weights};
    both.weights.insert(both.weights.end(), b.weights.begin(), b.weights.end());
    return both;
  };
  while (true) {
    double most_saved = 0;
    size_t first = 0, second = 0;
    for (size_t i = 0; i < batches.size(); ++i) {
      for (size_t j = i + 1; j < batches.size(); ++j) {
        const double saved = batches[i].cost() + batches[j].cost() - joined(batches[i], batches[j]).cost();
        if (saved > most_saved) most_saved = saved, first = i, second = j;
      }
    }
    if (most_saved == 0) return batches;
    batches[first] = joined(batches[first], batches[second]);
    batches.erase(batches.begin() + static_cast<std::ptrdiff_t>(second));
  }
}

void Muon::index_batches() {
  std::vector<int64_t> first_elements;
  int64_t num_elements = 0, num_places = 0;
  for (const at::Tensor& weight : weights_) {
    first_elements.push_back(num_elements);
    num_elements += weight.numel();
  }
  for (const Batch& batch : batches_) {
    num_places += static_cast<int64_t>(batch.weights.size()) * batch.rows * batch.columns;
  }
  const at::Tensor element_of_place = at::full({num_places}, num_elements, at::kLong);
  const at::Tensor place_of_element = at::empty({num_elements}, at::kLong);
  auto* const elements = element_of_place.mutable_data_ptr<int64_t>();
  auto* const places = place_of_element.mutable_data_ptr<int64_t>();
  int64_t first_place = 0;
  for (const Batch& batch : batches_) {
    std::vector<float> scales;
    for (const size_t w : batch.weights) {
      const int64_t rows = rows_of(weights_[w]), columns = columns_of(weights_[w]);
      const bool is_turned = rows > columns;
      for (int64_t row = 0; row < rows; ++row) {
        for (int64_t column = 0; column < columns; ++column) {
          const int64_t place = first_place + (is_turned ? column * batch.columns + row : row * batch.columns + column);
          const int64_t element = first_elements[w] + row * columns + column;
          elements[place] = element;
          places[element] = place;
        }
      }
      scales.push_back(static_cast<float>(kStepRms * std::sqrt(static_cast<double>(std::max(rows, columns)))));
      first_place += batch.rows * batch.columns;
    }
    scales_.push_back(at::tensor(scales).view({-1, 1, 1}).to(momentum_.device()));
  }
  element_of_place_ = element_of_place.to(momentum_.device());
  place_of_element_ = place_of_element.to(momentum_.device());
}

std::vector<at::Tensor> Muon::parts_of(const at::Tensor& flat) const {
  std::vector<at::Tensor> parts;
  int64_t begin = 0;
  for (const at::Tensor& weight : weights_) {
    parts.push_back(flat.narrow(0, begin, weight.numel()).view(weight.sizes()));
    begin += weight.numel();
  }
  return parts;
}

void Muon::step(double learning_rate, const at::Tensor& failed) {
  const at::NoGradGuard no_grad;
  rate_.fill_(learning_rate);
  failed_.copy_(failed);
  step_.run(&graphs_, [this] { take_step(); });
}

void Muon::discard_graph() {
  step_ = {};
  graphs_.release_memory();
}

void Muon::take_step() {
  const at::Tensor has_failed = failed_.to(at::kBool);
  std::vector<at::Tensor> gradients;
  for (const at::Tensor& weight : weights_) gradients.push_back(weight.grad().flatten());
  const at::Tensor gradient = at::cat(gradients), momentum = momentum_.lerp(gradient, 1 - kMomentum);
  // Selects values instead of multiplying by 0, because a product of 0 and NaN is NaN.
  momentum_.copy_(at::where(has_failed, momentum_, momentum));
  const at::Tensor direction = at::constant_pad_nd(gradient.lerp(momentum, kMomentum), {0, 1});  // Nesterov momentum
  const at::Tensor filled = direction.index_select(0, element_of_place_);
  std::vector<at::Tensor> steps;
  int64_t begin = 0;
  for (size_t b = 0; b < batches_.size(); ++b) {
    const auto count = static_cast<int64_t>(batches_[b].weights.size());
    const int64_t size = count * batches_[b].rows * batches_[b].columns;
    const at::Tensor matrices = filled.narrow(0, begin, size).view({count, batches_[b].rows, batches_[b].columns});
    steps.push_back((orthogonalized(matrices, type_) * scales_[b]).flatten());
    begin += size;
  }
  const at::Tensor step = at::cat(steps).index_select(0, place_of_element_);
  at::_foreach_mul_(weights_, 1 - (1 - failed_) * rate_ * weight_decay_);
  at::_foreach_add_(weights_, parts_of(at::where(has_failed, at::zeros_like(step), step * -rate_)));
}

}  // namespace pictura
