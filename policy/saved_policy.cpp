#include "pictura/policy/saved_policy.h"

#include <cstring>

#include <ATen/core/grad_mode.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/policy/safetensors.h"

namespace pictura {

std::vector<NamedTensor> to_tensors(const std::vector<StoredTensor>& stored) {
  std::vector<NamedTensor> tensors;
  for (const StoredTensor& one : stored) {
    const at::Tensor value = at::empty(one.shape, at::kFloat);
    std::memcpy(value.data_ptr(), one.values.data(), one.values.size() * sizeof(float));
    tensors.push_back({one.name, value});
  }
  return tensors;
}

std::vector<StoredTensor> to_stored(const std::vector<NamedTensor>& tensors) {
  std::vector<StoredTensor> stored;
  for (const NamedTensor& one : tensors) {
    const at::Tensor host = one.value.detach().to(at::kCPU, at::kFloat).contiguous();
    const float* const values = host.const_data_ptr<float>();
    stored.push_back({one.name, host.sizes().vec(), {values, values + host.numel()}});
  }
  return stored;
}

SavedPolicy parse_policy(const std::string& file, const std::string& path, bool average) {
  const StoredPolicy stored = parse_stored_policy(file, path, average);
  return {stored, to_tensors(stored.parameters)};
}

SavedPolicy read_policy(const std::string& path, bool average) {
  return parse_policy(read_policy_file(path), path, average);
}

void write_policy(const std::string& path, const SavedPolicy& policy, WeightType type, const std::string& commit) {
  write_stored_policy(path, {policy, to_stored(policy.parameters)}, type, commit);
}

void copy_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                  const std::vector<NamedTensor>& parameters) {
  const std::vector<StoredTensor> stored = to_stored(saved);
  check_finite(path, stored);
  const at::NoGradGuard no_grad;
  for (const NamedTensor& parameter : parameters) {
    const StoredTensor& found = find_parameter(path, stored, parameter.name, parameter.value.sizes().vec());
    at::Tensor target = parameter.value;
    target.copy_(to_tensors({found}).front().value);
  }
}

void restore_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                     const std::vector<NamedTensor>& parameters) {
  copy_tensors(path, saved, parameters);
  check_parameter_count(path, saved.size(), parameters.size());
}

void restore_policy(const SavedPolicy& saved, const Policy& policy) {
  const auto backbone = [](const std::string& hash) { return hash.empty() ? "\"conv\"" : "a program of hash " + hash; };
  PICTURA_CHECK(policy.backbone_hash() == saved.backbone_hash, "{}: policy.backbone: its policy has {}, expected {}",
                saved.path, backbone(saved.backbone_hash), backbone(policy.backbone_hash()));
  restore_tensors(saved.path, saved.parameters, policy.parameters());
}

void write_safetensors(const std::string& path, const std::vector<NamedTensor>& tensors,
                       const std::string& config_toml) {
  std::vector<SafeTensor> all;
  for (const NamedTensor& one : tensors) {
    const bool is_integral = at::isIntegralType(one.value.scalar_type(), /*includeBool=*/true);
    const at::Tensor host = one.value.detach().to(at::kCPU, is_integral ? at::kLong : at::kFloat).contiguous();
    all.push_back({one.name,
                   is_integral ? SafeType::i64 : SafeType::f32,
                   one.value.sizes().vec(),
                   {static_cast<const char*>(host.const_data_ptr()), host.nbytes()}});
  }
  write_file(path, safetensors(all, {{"format", "pt"}, {"config", config_toml}}));
}

}  // namespace pictura
