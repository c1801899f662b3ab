// Kernels of network_passes.h, launched asynchronously on a stream. Callers check cudaGetLastError().
#pragma once

#include <cuda_runtime_api.h>

#include "pictura/policy/rules/network_passes.h"

namespace pictura::cuda {

void launch_bias_gelu(const ActivationSize& size, const void* x, const float* bias, void* out, cudaStream_t stream);
void launch_bias_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                               void* grad_x_out, float* grad_bias_sums_out, cudaStream_t stream);
void launch_bias_norm_gelu(const ActivationSize& size, const void* x, const float* bias, void* out,
                           cudaStream_t stream);
void launch_bias_norm_gelu_backward(const ActivationSize& size, const void* x, const float* bias, const void* grad_out,
                                    void* grad_x_out, float* grad_bias_sums_out, cudaStream_t stream);
void launch_norm(const ActivationSize& size, const void* x, const void* position, int64_t period, const float* weight,
                 const float* bias, void* out, cudaStream_t stream);
void launch_norm_backward(const ActivationSize& size, const void* x, const void* position, int64_t period,
                          const float* weight, const void* grad_out, void* grad_x_out, float* sums_out,
                          cudaStream_t stream);
void launch_row_features(const RowSize& size, const float* rows, ActivationType type, void* out, cudaStream_t stream);
void launch_patches(const PatchSize& size, const uint8_t* images, ActivationType type, void* out, cudaStream_t stream);
/// Returns the shared memory that a block of each of the next two kernels needs at most, in bytes.
int64_t set_encoder_bytes(int64_t channels);
void launch_largest_embedding(const SetSize& size, const float* members, const int32_t* counts,
                              const SetParameters<const float>& parameters, void* out, uint8_t* which_out,
                              cudaStream_t stream);
void launch_largest_embedding_backward(const SetSize& size, const float* members,
                                       const SetParameters<const float>& parameters, const uint8_t* which,
                                       const void* grad_out, const SetParameters<float>& sums_out, cudaStream_t stream);

void launch_token_softmax(const TokenSize& size, const void* scores, void* out, cudaStream_t stream);
void launch_token_softmax_backward(const TokenSize& size, const void* out, const void* grad_out, void* grad_scores_out,
                                   cudaStream_t stream);

}  // namespace pictura::cuda
