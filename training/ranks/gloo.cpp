// Communicator of ranks that learn on hosts: torch's Gloo, if its headers were found at build time.
#include "pictura/common/error.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/ranks/ranks.h"

#ifdef PICTURA_HAS_GLOO
#include <chrono>
#include <thread>

#include <torch/csrc/distributed/c10d/HashStore.hpp>
#include <torch/csrc/distributed/c10d/ProcessGroupGloo.hpp>
#endif

namespace pictura {

#ifdef PICTURA_HAS_GLOO

namespace {

class GlooCommunicator final : public Communicator {
 public:
  explicit GlooCommunicator(Ranks* ranks) : ranks_(ranks) {
    const auto options = c10d::ProcessGroupGloo::Options::create(kForever);
    options->devices.push_back(c10d::ProcessGroupGloo::createDefaultDevice());
    c10::intrusive_ptr<c10d::Store> store = ranks->store();
    if (!store) store = c10::make_intrusive<c10d::HashStore>();
    try {
      group_ = c10::make_intrusive<c10d::ProcessGroupGloo>(store, rank(), size(), options);
    } catch (const std::exception& error) {
      ranks_->throw_if_lost();
      fail("rank {}: Gloo cannot connect the ranks: {}", rank(), error.what());
    }
  }
  ~GlooCommunicator() override {
    // The group's threads wait for the lost rank, and its destructor would wait for the threads. So the group is not
    // destroyed.
    if (has_failed_) static_cast<void>(group_.release());
  }

  std::string name() const override { return "gloo"; }
  int rank() const override { return ranks_->rank(); }
  int size() const override { return ranks_->size(); }
  void step() override { ranks_->step(); }

  void sum(const at::Tensor& tensor) override { all_reduce(tensor, c10d::ReduceOp::SUM); }
  void max(const at::Tensor& tensor) override { all_reduce(tensor, c10d::ReduceOp::MAX); }
  void broadcast(const at::Tensor& tensor, int root) override {
    if (tensor.numel() == 0) return;
    c10d::BroadcastOptions options;
    options.rootRank = root;
    finish(tensor, [&](std::vector<at::Tensor>& tensors) { return group_->broadcast(tensors, options); });
  }

 private:
  // Ranks detects a lost rank sooner than a timeout would.
  static constexpr std::chrono::hours kForever{24 * 365};

  void all_reduce(const at::Tensor& tensor, c10d::ReduceOp operation) {
    c10d::AllreduceOptions options;
    options.reduceOp = operation;
    finish(tensor, [&](std::vector<at::Tensor>& tensors) { return group_->allreduce(tensors, options); });
  }

  template <typename Begin>
  void finish(const at::Tensor& tensor, const Begin& begin) {
    ranks_->step();
    std::vector<at::Tensor> tensors{tensor};
    try {
      const c10::intrusive_ptr<c10d::Work> work = begin(tensors);
      while (!work->isCompleted()) {
        ranks_->check();
        std::this_thread::sleep_for(std::chrono::microseconds(20));
      }
      work->wait();
    } catch (const RankLost&) {
      has_failed_ = true;
      throw;
    } catch (const std::exception& error) {
      has_failed_ = true;
      ranks_->throw_if_lost();
      fail("rank {}: Gloo: {}", rank(), error.what());
    }
  }

  Ranks* const ranks_;
  c10::intrusive_ptr<c10d::ProcessGroupGloo> group_;
  bool has_failed_ = false;
};

}  // namespace

std::unique_ptr<Communicator> make_gloo_communicator(Ranks* ranks) { return std::make_unique<GlooCommunicator>(ranks); }

#else

std::unique_ptr<Communicator> make_gloo_communicator(Ranks*) {
  fail(
      "several processes that learn on the host need Gloo, but this program was built without its headers: install "
      "libgloo-dev and rebuild");
}

#endif

}  // namespace pictura
