#include "pictura/policy/precision.h"

#include <ATen/Context.h>
#include <c10/util/env.h>

#include "pictura/common/error.h"

namespace pictura {

void set_float32_products(Precision precision) {
  at::Context& context = at::globalContext();
  const bool is_tf32 = precision == Precision::tf32;
  // Torch's older settings must agree with its newer settings; otherwise reading the older settings throws, for
  // instance in torch's exporter to ONNX.
  context.setAllowTF32CuDNN(is_tf32);
  context.setAllowTF32CuBLAS(is_tf32);
  // The precision is set for each operation, because torch's setting for all operations does not affect convolutions,
  // which use TF32 by default.
  for (const at::Float32Op operation : {at::Float32Op::CONV, at::Float32Op::RNN, at::Float32Op::MATMUL}) {
    context.setFloat32Precision(at::Float32Backend::CUDA, operation,
                                is_tf32 ? at::Float32Precision::TF32 : at::Float32Precision::IEEE);
  }
}

void set_reproducible(bool reproducible) {
  if (reproducible) {
    constexpr const char* kName = "CUBLAS_WORKSPACE_CONFIG";
    c10::utils::set_env(kName, ":4096:8", /*overwrite=*/false);
    const std::string value = c10::utils::get_env(kName).value_or("");
    PICTURA_CHECK(value == ":4096:8" || value == ":16:8",
                  "train.reproducible: expected {} to be absent, \":4096:8\" or \":16:8\", with which cuBLAS is "
                  "reproducible, got \"{}\"",
                  kName, value);
  }
  at::Context& context = at::globalContext();
  context.setDeterministicAlgorithms(reproducible, /*warn_only=*/false);
  // Torch would fill all new memory, so that reads of uninitialised memory are deterministic. This is not needed,
  // because no code here reads uninitialised memory.
  context.setDeterministicFillUninitializedMemory(false);
  context.setDeterministicCuDNN(reproducible);
}

Autotuner::Autotuner() {
  at::Context& context = at::globalContext();
  context.setBenchmarkCuDNN(!context.deterministicCuDNN());
}

Autotuner::~Autotuner() { at::globalContext().setBenchmarkCuDNN(false); }

}  // namespace pictura
