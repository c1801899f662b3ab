// Writes policies and their results, for tests of other implementations. For each policy, `policy_reference FOLDER`
// writes its weights (NAME.safetensors), and inputs with the logits and values of the library's forward pass in fp32
// (NAME_io.safetensors).
#include <cstdio>
#include <string>

#include <ATen/ATen.h>
#include <ATen/core/grad_mode.h>

#include "pictura/training/checkpoint.h"

namespace pictura {
namespace {

/// Observations of agents drawn at random; sets have counts from none to all.
std::vector<NamedTensor> draw_inputs(const Config& config, int64_t batch, Observation* observation_out) {
  std::vector<NamedTensor> inputs;
  const auto put = [&inputs](std::string name, at::Tensor* to, const at::Tensor& value) {
    *to = value;
    inputs.push_back({std::move(name), value});
  };
  for (size_t i = 0; i < std::size(kObservationArrays); ++i) {
    const ObservationArray& array = kObservationArrays[i];
    if (array.part == ObservationPart::walls) continue;
    at::Tensor* const to = &(observation_out->*kObservationTensors[i]);
    if (array.type == ElementType::i32) {
      const at::Tensor largest = at::tensor({kMaxPartners, kMaxLanes, kMaxBoundaries, kMaxControls, 0}, at::kInt);
      put(std::string(array.name), to, (at::rand({batch, kNumEntitySets}) * (largest + 1)).floor().to(at::kInt));
    } else if (array.rows > 1 && array.name != "waypoints") {
      put(std::string(array.name), to, at::randn({batch, array.rows, array.features}) * 0.3);
    } else {
      put(std::string(array.name), to, at::randn({batch, array.rows * array.features}) * 0.3);
    }
  }
  if (config.policy.modality == Modality::perspective) {
    const at::Tensor pixels = at::randint(256, {batch, 4, 3, 27, 48}, at::kByte);
    observation_out->images = {{pixels, {0, 1, 2, 3}}};
    inputs.push_back({"rgb", pixels.to(at::kLong)});
  }
  return inputs;
}

void write_reference(const std::string& folder, const std::string& name, const Config& config) {
  const at::NoGradGuard no_grad;
  const PolicyNetwork policy(config.policy, 4, 7);
  for (const NamedTensor& parameter : policy.parameters()) {
    // Moves parameters away from their initial values, in which biases are zero and norms one.
    at::Tensor value = parameter.value;
    value.add_(at::randn_like(value) * 0.02);
  }
  Observation observation;
  std::vector<NamedTensor> tensors = draw_inputs(config, 9, &observation);
  const Policy::Output output = policy.forward(observation);
  tensors.push_back({"logits", output.logits});
  tensors.push_back({"value", output.value});
  write_safetensors(folder + "/" + name + ".safetensors", policy.parameters(), to_toml(config));
  write_safetensors(folder + "/" + name + "_io.safetensors", tensors, "");
}

}  // namespace
}  // namespace pictura

int main(int argc, char** argv) try {
  using pictura::Modality;
  if (argc != 2) return std::fprintf(stderr, "usage: policy_reference FOLDER\n"), 2;
  at::manual_seed(3);
  pictura::Config config;
  for (const bool points : {false, true}) {
    const std::string suffix = points ? "_points" : "";
    config.policy.point_features = points;
    config.policy.modality = Modality::vector;
    pictura::write_reference(argv[1], "vector" + suffix, config);
    config.policy.modality = Modality::perspective;
    pictura::write_reference(argv[1], "perspective" + suffix, config);
  }
  config.policy.modality = Modality::vector;
  config.policy.segment_features = true;
  pictura::write_reference(argv[1], "segments", config);
  config.policy.segment_features = false;
  config.policy.layer_norm = config.policy.residual = true;
  config.policy.modality = Modality::vector;
  pictura::write_reference(argv[1], "normalized", config);
  config.policy.layer_norm = config.policy.residual = false;
  config.policy.modality = Modality::perspective;
  config.policy.patch_px = 4;
  config.policy.conv_channels = {24, 32};
  config.policy.conv_kernels = {1, 3};
  config.policy.conv_strides = {1, 2};
  config.policy.attention_mlp = 0;
  config.policy.num_queries = 3;
  pictura::write_reference(argv[1], "patches", config);
  config.policy.conv_norm = true;
  pictura::write_reference(argv[1], "normalized_convolutions", config);
  config.policy.concatenate_queries = true;
  pictura::write_reference(argv[1], "concatenated_queries", config);
  config.policy.attention_mlp = 5;
  pictura::write_reference(argv[1], "concatenated_queries_mlp", config);
  return 0;
} catch (const std::exception& error) {
  std::fprintf(stderr, "error: %s\n", error.what());
  return 1;
}
