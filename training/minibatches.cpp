#include "pictura/training/minibatches.h"

#include "pictura/policy/torch_device.h"

namespace pictura {

namespace {

constexpr int64_t kOfAnotherRank = -1;

}  // namespace

Minibatch Minibatch::part(const Chunk& chunk) const {
  Minibatch result{chunk.rows, global_size, chunk.take(advantages), shares.defined() ? chunk.take(shares) : shares,
                   scene_scale};
  if (chunk.count == chunk.size()) return result;
  if (!shares.defined()) {
    result.shares = at::constant_pad_nd(at::ones({chunk.count}, advantages.options()), {0, chunk.size() - chunk.count});
  }
  // Means divide by all rows of the chunk, including padding rows, so weights are scaled to compensate.
  result.shares = result.shares * (static_cast<double>(chunk.size()) / static_cast<double>(chunk.count));
  return result;
}

Minibatches::Minibatches(const at::Tensor& rows, const Rollout& rollout, int64_t max_size, LearnerExecutor* executor,
                         Communicator* communicator)
    : executor_(executor) {
  // Transitions of all ranks are numbered by step, then by slot; each rank has consecutive slots.
  const int64_t num_steps = rollout.num_steps(), num_slots = rollout.num_slots();
  const at::Tensor begins = at::searchsorted(rows, at::arange(num_steps + 1, rows.options()) * num_slots);
  const at::Tensor counts = at::zeros({num_steps, communicator->size()}, rows.options());
  counts.select(1, communicator->rank()).copy_(begins.diff());
  communicator->sum(counts);
  const at::Tensor first_numbers =
      (counts.flatten().cumsum(0).view_as(counts) - counts).select(1, communicator->rank());
  const at::Tensor step = rows.div(num_slots, "floor");
  const at::Tensor numbers =
      (first_numbers - begins.narrow(0, 0, num_steps)).index_select(0, step) + at::arange(rows.size(0), rows.options());
  global_size_ = counts.sum().item<int64_t>();
  count_ = (global_size_ + max_size - 1) / max_size;
  own_ = at::full({global_size_}, kOfAnotherRank, rows.options()).index_copy_(0, numbers, rows);
}

void Minibatches::shuffle(uint64_t seed, int64_t update, int64_t epoch) {
  const at::Tensor shuffled = at::empty_like(own_);
  executor_->permute(Permutation(seed, update, epoch, global_size_), span_of<const int64_t>(own_),
                     span_of<int64_t>(shuffled), current_stream(executor_->device()));
  places_ = at::nonzero(shuffled != kOfAnotherRank).squeeze(1);
  rows_ = shuffled.index_select(0, places_);
  const at::Tensor begins = (at::arange(count_ + 1, places_.options()) * global_size_).div(count_, "floor");
  begins_ = at::searchsorted(places_, begins).cpu();
}

Minibatch Minibatches::operator[](int64_t m) const {
  const int64_t* const begins = begins_.const_data_ptr<int64_t>();
  return {rows_.narrow(0, begins[m], begins[m + 1] - begins[m]),
          global_size_ * (m + 1) / count_ - global_size_ * m / count_};
}

int64_t Minibatches::count_own_among_first(int64_t count) const {
  return at::searchsorted(places_, at::full({}, count, places_.options())).item<int64_t>();
}

}  // namespace pictura
