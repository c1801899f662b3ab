// Communicator of ranks that learn on CUDA devices: NCCL, from the library that comes with torch's CUDA library. The
// library is opened here, and its few functions are declared here, so that programs build and start without NCCL.
#include <atomic>

#include <c10/core/DeviceGuard.h>
#include <dlfcn.h>

#include "pictura/common/error.h"
#include "pictura/policy/torch_device.h"
#include "pictura/training/ranks/communicator.h"
#include "pictura/training/ranks/ranks.h"

namespace pictura {

namespace {

// Types as in nccl.h of NCCL 2.
struct NcclId {
  char bytes[128];
};
using NcclComm = struct NcclCommOpaque*;
using NcclResult = int;  // 0: success
enum NcclType : int { kNcclU8 = 1, kNcclI32 = 2, kNcclI64 = 4, kNcclF32 = 7, kNcclF64 = 8 };
enum NcclOperation : int { kNcclSum = 0, kNcclMax = 2 };

struct Nccl {
  const char* (*error_text)(NcclResult);
  NcclResult (*get_unique_id)(NcclId*);
  NcclResult (*comm_init_rank)(NcclComm*, int size, NcclId, int rank);
  NcclResult (*comm_destroy)(NcclComm);
  NcclResult (*comm_abort)(NcclComm);
  NcclResult (*all_reduce)(const void*, void*, size_t count, NcclType, NcclOperation, NcclComm, void* stream);
  NcclResult (*broadcast)(const void*, void*, size_t count, NcclType, int root, NcclComm, void* stream);

  Nccl() {
    // Torch's CUDA library is open at this point, and has opened NCCL from its own folder.
    static constexpr const char* kFile = "libnccl.so.2";
    void* const library = dlopen(kFile, RTLD_NOW | RTLD_LOCAL | RTLD_NODELETE);
    PICTURA_CHECK(library, "several GPUs need NCCL: {} cannot be opened: {}", kFile, dlerror());
    const auto find = [library](auto* function, const char* name) {
      *function = reinterpret_cast<std::remove_reference_t<decltype(*function)>>(dlsym(library, name));
      PICTURA_CHECK(*function, "{} has no function {}", kFile, name);
    };
    find(&error_text, "ncclGetErrorString");
    find(&get_unique_id, "ncclGetUniqueId");
    find(&comm_init_rank, "ncclCommInitRank");
    find(&comm_destroy, "ncclCommDestroy");
    find(&comm_abort, "ncclCommAbort");
    find(&all_reduce, "ncclAllReduce");
    find(&broadcast, "ncclBroadcast");
  }
};

NcclType type_of(const at::Tensor& tensor) {
  switch (tensor.scalar_type()) {
    case at::kByte: return kNcclU8;
    case at::kInt: return kNcclI32;
    case at::kLong: return kNcclI64;
    case at::kFloat: return kNcclF32;
    case at::kDouble: return kNcclF64;
    default: fail("communicator: expected u8, i32, i64, f32 or f64, got {}", at::toString(tensor.scalar_type()));
  }
}

class NcclCommunicator final : public Communicator {
 public:
  NcclCommunicator(Ranks* ranks, Device device) : ranks_(ranks), device_(torch_device(device)) {
    NcclId id{};
    if (rank() == 0) check(nccl_.get_unique_id(&id), "ncclGetUniqueId");
    const std::string own(id.bytes, sizeof id.bytes), first = ranks->texts("nccl", rank() == 0 ? own : "").front();
    std::copy(first.begin(), first.end(), id.bytes);
    const c10::DeviceGuard guard(device_);
    check(nccl_.comm_init_rank(&comm_, size(), id, rank()), "ncclCommInitRank");
    // Aborting ends kernels that wait for a lost rank, and therefore also calls that wait for these kernels.
    ranks_->on_lost([this] {
      if (!is_aborted_.exchange(true)) nccl_.comm_abort(comm_);
    });
  }
  ~NcclCommunicator() override {
    ranks_->on_lost({});
    if (!is_aborted_) nccl_.comm_destroy(comm_);
  }

  std::string name() const override { return "nccl"; }
  int rank() const override { return ranks_->rank(); }
  int size() const override { return ranks_->size(); }
  void step() override { ranks_->step(); }

  void sum(const at::Tensor& tensor) override { all_reduce(tensor, kNcclSum); }
  void max(const at::Tensor& tensor) override { all_reduce(tensor, kNcclMax); }
  void broadcast(const at::Tensor& tensor, int root) override {
    run(tensor, "ncclBroadcast", [&](void* data, size_t count, NcclType type, void* stream) {
      return nccl_.broadcast(data, data, count, type, root, comm_, stream);
    });
  }

 private:
  void all_reduce(const at::Tensor& tensor, NcclOperation operation) {
    run(tensor, "ncclAllReduce", [&](void* data, size_t count, NcclType type, void* stream) {
      return nccl_.all_reduce(data, data, count, type, operation, comm_, stream);
    });
  }

  // Runs an operation on a tensor. A host tensor is copied to the device, and the call waits for its result.
  template <typename Operation>
  void run(const at::Tensor& tensor, const char* name, const Operation& operation) {
    ranks_->step();
    if (tensor.numel() == 0) return;
    const c10::DeviceGuard guard(device_);
    const at::Tensor on_device = tensor.to(device_);
    const Stream stream = current_stream({MemorySpace::cuda, device_.index()});
    check(operation(on_device.data_ptr(), static_cast<size_t>(tensor.numel()), type_of(tensor), stream.handle), name);
    if (tensor.device() == device_) return;
    tensor.copy_(on_device);
    ranks_->check();
  }

  void check(NcclResult result, const char* name) const {
    if (result == 0) return;
    ranks_->check();
    fail("rank {} on {}: {}: {}", rank(), device_.str(), name, nccl_.error_text(result));
  }

  Ranks* const ranks_;
  const at::Device device_;
  const Nccl nccl_;
  NcclComm comm_ = nullptr;
  std::atomic<bool> is_aborted_ = false;
};

}  // namespace

std::unique_ptr<Communicator> make_nccl_communicator(Ranks* ranks, Device device) {
  return std::make_unique<NcclCommunicator>(ranks, device);
}

}  // namespace pictura
