#include "pictura/training/ranks/communicator.h"

#include <cstring>

#include "pictura/training/ranks/ranks.h"

namespace pictura {

namespace {

class NullCommunicator final : public Communicator {
 public:
  std::string name() const override { return "null"; }
  int rank() const override { return 0; }
  int size() const override { return 1; }
  void sum(const at::Tensor&) override {}
  void max(const at::Tensor&) override {}
  void broadcast(const at::Tensor&, int) override {}
  void step() override {}
};

at::Tensor bytes_tensor(const void* bytes, size_t size) {
  const at::Tensor tensor = at::empty({static_cast<int64_t>(size)}, at::kByte);
  if (size > 0) std::memcpy(tensor.data_ptr(), bytes, size);
  return tensor;
}

}  // namespace

double Communicator::max_of(double value) {
  const at::Tensor tensor = at::full({1}, value, at::kDouble);
  max(tensor);
  return tensor.item<double>();
}

std::vector<std::vector<uint8_t>> Communicator::gather(const std::vector<uint8_t>& bytes) {
  const at::Tensor sizes = at::zeros({size()}, at::kLong);
  sizes[rank()] = static_cast<int64_t>(bytes.size());
  sum(sizes);
  std::vector<std::vector<uint8_t>> all;
  for (int root = 0; root < size(); ++root) {
    const at::Tensor its =
        root == rank() ? bytes_tensor(bytes.data(), bytes.size()) : at::empty({sizes[root].item<int64_t>()}, at::kByte);
    broadcast(its, root);
    const uint8_t* const first = its.const_data_ptr<uint8_t>();
    all.emplace_back(first, first + its.numel());
  }
  return all;
}

std::string Communicator::from_first(const std::string& bytes) {
  const at::Tensor size = at::full({1}, static_cast<int64_t>(bytes.size()), at::kLong);
  broadcast(size, 0);
  const at::Tensor tensor =
      is_first() ? bytes_tensor(bytes.data(), bytes.size()) : at::empty({size.item<int64_t>()}, at::kByte);
  broadcast(tensor, 0);
  return {static_cast<const char*>(tensor.const_data_ptr()), static_cast<size_t>(tensor.numel())};
}

SimulatorTotals totals_of_all(SimulatorTotals own, Communicator* communicator) {
  // Counts are far below 2^53, so sums of doubles are exact.
  std::vector<double> values;
  const auto put = [&values](const auto& value, const auto&) { values.push_back(static_cast<double>(value)); };
  SimulatorTotals::visit(own, own, put, put);
  const at::Tensor sums = at::tensor(values, at::kDouble);
  communicator->sum(sums);
  const double* next = sums.const_data_ptr<double>();
  const auto take = [&next](auto& value, const auto&) { value = static_cast<std::decay_t<decltype(value)>>(*next++); };
  SimulatorTotals::visit(own, own, take, take);
  return own;
}

Communicator* single_communicator() {
  static NullCommunicator communicator;
  return &communicator;
}

std::unique_ptr<Communicator> make_communicator(Ranks* ranks, Device device) {
  if (ranks->size() == 1) return std::make_unique<NullCommunicator>();
  return device.is_host() ? make_gloo_communicator(ranks) : make_nccl_communicator(ranks, device);
}

}  // namespace pictura
