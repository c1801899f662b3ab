// Passes of a network on a CUDA device: launches.
#include <memory>

#include "pictura/backend_cuda/learner/network_kernels.h"
#include "pictura/common/cuda/check.h"
#include "pictura/common/cuda/device_guard.h"
#include "pictura/common/error.h"

namespace pictura {

std::unique_ptr<NetworkPasses> make_cuda_network_passes(Device device);

namespace {

class NetworkPassesCuda final : public NetworkPasses {
 public:
  explicit NetworkPassesCuda(Device device) : device_(device) {}

  void bias_gelu(const ActivationSize& size, const void* x, const float* bias, void* out, Stream stream) override {
    PICTURA_CHECK(supports_gelu(size.channels), "bias_gelu: rows of {} channels", size.channels);
    launch(cuda::launch_bias_gelu, stream, size, x, bias, out);
  }

  void bias_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                          void* grad_x_out, float* grad_bias_sums_out, Stream stream) override {
    PICTURA_CHECK(supports_gelu(size.channels), "bias_gelu_backward: rows of {} channels", size.channels);
    launch(cuda::launch_bias_gelu_backward, stream, size, x, bias, grad_out, grad_x_out, grad_bias_sums_out);
  }

  void bias_norm_gelu(const ActivationSize& size, const void* x, const float* bias, void* out, Stream stream) override {
    PICTURA_CHECK(supports_norm(size.channels), "bias_norm_gelu: rows of {} channels", size.channels);
    launch(cuda::launch_bias_norm_gelu, stream, size, x, bias, out);
  }

  void bias_norm_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                               void* grad_x_out, float* grad_bias_sums_out, Stream stream) override {
    PICTURA_CHECK(supports_norm(size.channels), "bias_norm_gelu_backward: rows of {} channels", size.channels);
    launch(cuda::launch_bias_norm_gelu_backward, stream, size, x, bias, grad_out, grad_x_out, grad_bias_sums_out);
  }

  void norm(const ActivationSize& size, const void* x, const void* position, int64_t period, const float* weight,
            const float* bias, void* out, Stream stream) override {
    PICTURA_CHECK(supports_norm(size.channels), "norm: rows of {} channels", size.channels);
    launch(cuda::launch_norm, stream, size, x, position, period, weight, bias, out);
  }

  void norm_backward(const ActivationSize& size, const void* x, const void* position, int64_t period,
                     const float* weight, const void* grad_out, void* grad_x_out, float* sums_out,
                     Stream stream) override {
    PICTURA_CHECK(supports_norm(size.channels), "norm_backward: rows of {} channels", size.channels);
    launch(cuda::launch_norm_backward, stream, size, x, position, period, weight, grad_out, grad_x_out, sums_out);
  }

  void row_features(const RowSize& size, const float* rows, ActivationType type, void* out, Stream stream) override {
    PICTURA_CHECK(size.width() <= RowSize::kMaxWidth, "row_features: {} numbers per row", size.width());
    launch(cuda::launch_row_features, stream, size, rows, type, out);
  }

  void patches(const PatchSize& size, const uint8_t* images, ActivationType type, void* out, Stream stream) override {
    PICTURA_CHECK(PatchSize::supports(size.patch_px), "patches: of {} pixels squared", size.patch_px);
    launch(cuda::launch_patches, stream, size, images, type, out);
  }

  bool fits_set_encoder(int64_t channels) const override {
    int bytes = 0;
    PICTURA_CUDA(cudaDeviceGetAttribute(&bytes, cudaDevAttrMaxSharedMemoryPerBlockOptin, device_.index));
    return cuda::set_encoder_bytes(channels) <= bytes;
  }

  void largest_embedding(const SetSize& size, const float* members, const int32_t* counts,
                         const SetParameters<const float>& parameters, void* out, uint8_t* which_out,
                         Stream stream) override {
    check(size);
    launch(cuda::launch_largest_embedding, stream, size, members, counts, parameters, out, which_out);
  }

  void largest_embedding_backward(const SetSize& size, const float* members,
                                  const SetParameters<const float>& parameters, const uint8_t* which,
                                  const void* grad_out, const SetParameters<float>& sums_out, Stream stream) override {
    check(size);
    launch(cuda::launch_largest_embedding_backward, stream, size, members, parameters, which, grad_out, sums_out);
  }

  void token_softmax(const TokenSize& size, const void* scores, void* out, Stream stream) override {
    PICTURA_CHECK(size.columns % 2 == 0, "token_softmax: {} columns", size.columns);
    launch(cuda::launch_token_softmax, stream, size, scores, out);
  }

  void token_softmax_backward(const TokenSize& size, const void* out, const void* grad_out, void* grad_scores_out,
                              Stream stream) override {
    PICTURA_CHECK(size.columns % 2 == 0, "token_softmax_backward: {} columns", size.columns);
    launch(cuda::launch_token_softmax_backward, stream, size, out, grad_out, grad_scores_out);
  }

 private:
  static void check(const SetSize& size) {
    PICTURA_CHECK(SetSize::supports(size.channels, size.channels, size.members.width(), size.max_members),
                  "largest_embedding: {} members of {} numbers, {} channels", size.max_members, size.members.width(),
                  size.channels);
  }

  template <typename Launcher, typename... Arguments>
  void launch(Launcher launcher, Stream stream, const Arguments&... arguments) const {
    const DeviceGuard guard(device_);
    launcher(arguments..., static_cast<cudaStream_t>(stream.handle));
    PICTURA_CUDA(cudaGetLastError());
  }

  Device device_;
};

}  // namespace

std::unique_ptr<NetworkPasses> make_cuda_network_passes(Device device) {
  return std::make_unique<NetworkPassesCuda>(device);
}

}  // namespace pictura
