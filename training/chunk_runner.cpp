#include "pictura/training/chunk_runner.h"

#include <algorithm>

#include <ATen/core/grad_mode.h>

namespace pictura {

using Mode = RepeatedWork::Mode;

ChunkRunner::ChunkRunner(const Policy& policy, const RolloutObservations& observations, PhaseTimer* timer,
                         Graphs* graphs)
    : policy_(policy),
      observations_(observations),
      timer_(timer),
      own_graphs_(Device{}, /*are_used=*/false),
      graphs_(graphs ? graphs : &own_graphs_),
      stats_(at::zeros({kNumLossStats}, observations.arrays().ego.options().dtype(at::kDouble))) {}

void ChunkRunner::clear() {
  works_.clear();
  graphs_->release_memory();
}

// Graphs contain addresses, so values are copied to the same address. Without graphs, tensors are assigned.
void ChunkRunner::set(at::Tensor* to, const at::Tensor& value) const {
  if (!graphs_->are_used() || !value.defined())
    *to = value;
  else if (to->defined() && to->sizes() == value.sizes())
    to->copy_(value);
  else
    *to = value.clone();
}

ChunkRunner::Work& ChunkRunner::work_of(int64_t size) {
  if (!graphs_->are_used()) return works_[0];
  if (generation_ != observations_.generation()) {
    clear();
    generation_ = observations_.generation();
  }
  if (works_.size() == kMaxSizes && !works_.contains(size)) {
    works_.erase(std::min_element(works_.begin(), works_.end(),
                                  [](const auto& a, const auto& b) { return a.second.last_use < b.second.last_use; }));
  }
  Work& work = works_[size];
  work.last_use = ++num_uses_;
  return work;
}

ChunkRunner::Work& ChunkRunner::observe(const at::Tensor& rows) {
  Work& work = work_of(rows.size(0));
  set(&work.chunk.rows, rows);
  const PhaseTimer::Scope timed(observations_.draws_when_gathered() ? timer_ : nullptr, Phase::render);
  const Mode mode = work.observe.next_mode(*graphs_, observations_.are_complete());
  if (mode != Mode::launch) work.observation = {};  // freed before the next observation is allocated
  work.observe.run(mode, graphs_,
                   [&] { work.observation = observations_.gather(work.chunk.rows, policy_.drawn_patch_px()); });
  return work;
}

Policy::Output ChunkRunner::act(const at::Tensor& rows) {
  const at::NoGradGuard no_grad;
  Work& work = observe(rows);
  const PhaseTimer::Scope timed(timer_, Phase::forward);
  const Mode mode = work.act.next_mode(*graphs_, work.observe.is_captured());
  work.act.run(mode, graphs_, [&] { work.output = policy_.forward(work.observation); });
  return work.output;
}

Policy::Output ChunkRunner::forward_no_grad(const at::Tensor& rows) {
  const at::NoGradGuard no_grad;
  const Work& work = observe(rows);
  const PhaseTimer::Scope timed(timer_, Phase::learn);
  return policy_.forward(work.observation);
}

void ChunkRunner::set_targets(const Targets& targets) {
  const auto address = [](const at::Tensor& t) { return t.defined() ? t.const_data_ptr() : nullptr; };
  // Losses with a teacher need other graphs than losses without one.
  if (targets.teacher_log_probs.defined() != targets_.teacher_log_probs.defined() ||
      address(targets.teacher_scene) != address(targets_.teacher_scene)) {
    clear();
  }
  set(&targets_.actions, targets.actions);
  set(&targets_.old_log_probs, targets.old_log_probs);
  set(&targets_.returns, targets.returns);
  set(&targets_.teacher_log_probs, targets.teacher_log_probs);
  set(&targets_.teacher_weight, targets.teacher_weight);
  targets_.teacher_scene = targets.teacher_scene;  // a copy at a fixed address would double its memory
}

at::Tensor ChunkRunner::add_gradients(const Minibatch& minibatch, int64_t forward_chunk, const LossFunction& loss) {
  stats_.zero_();
  for_each_chunk(minibatch.rows, {forward_chunk}, [&](const Chunk& of_rows) {
    const Minibatch chunk = minibatch.part(of_rows);
    Work& work = observe(chunk.rows);
    set(&work.chunk.advantages, chunk.advantages);
    // A product with 1 changes no bit, so one graph serves full and padded chunks.
    set(&work.chunk.shares,
        chunk.shares.defined() || !graphs_->are_used() ? chunk.shares : at::ones_like(chunk.advantages));
    set(&work.chunk.scene_scale, chunk.scene_scale);
    if (!work.weight.defined()) work.weight = at::empty({}, stats_.options());
    work.weight.fill_(static_cast<double>(of_rows.count) / static_cast<double>(minibatch.global_size));

    // Both passes use the same mode: graphs keep no autograd state from which a backward pass could run call by call.
    const Mode mode = work.learn.next_mode(*graphs_, work.observe.is_captured());
    if (mode == Mode::capture) graphs_->release_cached_memory();
    {
      const PhaseTimer::Scope timed(timer_, Phase::learn);
      work.learn.run(mode, graphs_,
                     [&] { work.losses = loss(policy_.forward(work.observation), targets_, work.chunk); });
    }
    const PhaseTimer::Scope timed(timer_, Phase::backward);
    work.backward.run(mode, graphs_, [&] {
      const Losses& losses = work.losses;
      (losses.total * work.weight.to(losses.total.scalar_type())).backward();
      stats_.narrow(0, 0, losses.stats.size(0)) += work.weight * losses.stats;
    });
    work.losses = {};
  });
  return stats_;
}

Losses ChunkRunner::losses(const Minibatch& chunk, const LossFunction& loss) {
  const Work& work = observe(chunk.rows);
  const PhaseTimer::Scope timed(timer_, Phase::diagnose);
  return loss(policy_.forward(work.observation), targets_, chunk);
}

}  // namespace pictura
