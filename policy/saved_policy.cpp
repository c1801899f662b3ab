#include "pictura/policy/saved_policy.h"

#include <algorithm>
#include <bit>
#include <cstring>

#include <ATen/core/grad_mode.h>
#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/json_text.h"
#include "pictura/policy/checkpoint_file.h"
#include "pictura/policy/policy_json.h"

namespace pictura {

namespace {

using nlohmann::ordered_json;

static_assert(std::endian::native == std::endian::little, "safetensors are little endian");

constexpr std::string_view kNoHash = "0000000000000000";
constexpr size_t kLengthBytes = sizeof(uint64_t);

struct StoredType {
  std::string_view name;  // in the header
  at::ScalarType type;
};

constexpr StoredType kStoredTypes[] = {{"F32", at::kFloat}, {"BF16", at::kBFloat16}, {"I64", at::kLong}};

StoredType stored_type(const at::Tensor& tensor, WeightType weights) {
  if (at::isIntegralType(tensor.scalar_type(), /*includeBool=*/true)) return kStoredTypes[2];
  return kStoredTypes[weights == WeightType::bf16 ? 1 : 0];
}

std::string safetensors(const std::vector<NamedTensor>& tensors, WeightType weights, const ordered_json& metadata) {
  std::string data;
  ordered_json header;
  header["__metadata__"] = metadata;
  for (const NamedTensor& tensor : tensors) {
    const StoredType stored = stored_type(tensor.value, weights);
    const at::Tensor host = tensor.value.detach().to(at::kCPU, stored.type).contiguous();
    const size_t begin = data.size();
    data.append(static_cast<const char*>(host.const_data_ptr()), host.nbytes());
    header[tensor.name] = {
        {"dtype", stored.name}, {"shape", tensor.value.sizes().vec()}, {"data_offsets", {begin, data.size()}}};
  }
  std::string text = json_text(header);
  text.append((8 - text.size() % 8) % 8, ' ');  // data begin at a multiple of eight bytes
  const uint64_t length = text.size();
  std::string file(reinterpret_cast<const char*>(&length), sizeof length);
  return file + text + data;
}

// Returns the hash of the whole file with zeros for the digits of `hash`, which its metadata hold; empty if the
// metadata do not hold that hash.
std::string hash_of_file(std::string file, const std::string& hash) {
  const std::string key = R"("hash":")";
  const size_t place = file.find(key + hash);
  if (hash.size() != kNoHash.size() || place == std::string::npos) return "";
  file.replace(place + key.size(), kNoHash.size(), kNoHash);
  return fmt::format("{:016x}", pictura::hash_of(file));
}

at::Tensor read_tensor(const ordered_json& entry, std::string_view data, const std::string& what) {
  const auto name = entry.at("dtype").get<std::string>();
  const auto* const stored = std::find_if(std::begin(kStoredTypes), std::end(kStoredTypes),
                                          [&](const StoredType& t) { return t.name == name; });
  PICTURA_CHECK(stored != std::end(kStoredTypes) && stored->type != at::kLong,
                "{}: dtype: expected F32 or BF16, got {}", what, name);
  const auto shape = entry.at("shape").get<std::vector<int64_t>>();
  const auto begin = entry.at("data_offsets").at(0).get<uint64_t>();
  const auto end = entry.at("data_offsets").at(1).get<uint64_t>();
  PICTURA_CHECK(begin <= end && end <= data.size(), "{}: data_offsets: expected a range within {} bytes, got {} to {}",
                what, data.size(), begin, end);
  uint64_t bytes = at::elementSize(stored->type);
  for (const int64_t size : shape) {
    PICTURA_CHECK(size > 0 && size <= static_cast<int64_t>(data.size()),
                  "{}: shape: expected sizes from 1 to {}, got {}", what, data.size(), size);
    bytes *= static_cast<uint64_t>(size);
    PICTURA_CHECK(bytes <= end - begin, "{}: shape: expected one of {} bytes, got more", what, end - begin);
  }
  PICTURA_CHECK(bytes == end - begin, "{}: shape: expected one of {} bytes, got {}", what, end - begin, bytes);
  at::Tensor value = at::empty(shape, stored->type);
  std::memcpy(value.data_ptr(), data.data() + begin, bytes);
  return value.to(at::kFloat);
}

SavedPolicy parse_safetensors(const std::string& file, const std::string& path) {
  uint64_t length = 0;
  if (file.size() >= kLengthBytes) std::memcpy(&length, file.data(), sizeof length);
  PICTURA_CHECK(
      file.size() >= kLengthBytes && length <= file.size() - kLengthBytes,
      "{}: expected a checkpoint, which begins with PICTCKPT, or safetensors; got neither, or a truncated file", path);
  SavedPolicy result;
  result.path = path;
  try {
    const ordered_json header = parse_json(file.substr(kLengthBytes, length));
    const ordered_json metadata = header.value("__metadata__", ordered_json::object());
    PICTURA_CHECK(metadata.contains("config") && metadata.contains("schema"),
                  "{}: expected safetensors of a policy, as training or `pictura export` writes them: "
                  "its metadata lack 'config' or 'schema'",
                  path);
    const auto text = [&](const char* key) { return metadata.at(key).get<std::string>(); };
    PICTURA_CHECK(hash_of_file(file, text("hash")) == text("hash"),
                  "{}: damaged or truncated: its bytes do not have the hash that its metadata name", path);
    result.config = parse_saved_config(text("config"), path + ": config");
    check_schema(parse_json(text("schema")), result.config, path);
    result.rig = rig_from_json(parse_json(text("rig")));
    result.backbone_hash = text("backbone_hash");
    result.update = std::stoll(text("update"));
    result.agent_steps = std::stoll(text("agent_steps"));
    if (metadata.contains("rate_factors")) parse_json(text("rate_factors")).get_to(result.rate_factors);
    const std::string_view data = std::string_view(file).substr(kLengthBytes + length);
    for (const auto& [name, entry] : header.items()) {
      if (name != "__metadata__") {
        result.parameters.push_back({name, read_tensor(entry, data, path + ": " + name)});
      }
    }
  } catch (const nlohmann::json::exception& error) {
    fail("{}: its header cannot be read: {}", path, error.what());
  } catch (const std::logic_error& error) {
    fail("{}: its metadata cannot be read: {}", path, error.what());
  }
  return result;
}

}  // namespace

std::string read_policy_file(const std::string& path) {
  return read_file(path, size_t{1} << 36, [&path](std::string_view first) {
    // Safetensors begin with the length of their JSON header.
    uint64_t length = 0;
    const bool is_long = first.size() > sizeof length;
    if (is_long) std::memcpy(&length, first.data(), sizeof length);
    PICTURA_CHECK(is_checkpoint(first) || (is_long && length > 0 && first[sizeof length] == '{'),
                  "{}: expected a checkpoint, which begins with PICTCKPT, or safetensors; got neither, "
                  "or a truncated file",
                  path);
  });
}

SavedPolicy parse_policy(const std::string& file, const std::string& path, bool average) {
  PICTURA_CHECK(!average || is_checkpoint(file),
                "{}: holds one set of weights: expected a checkpoint to choose the average of", path);
  if (!is_checkpoint(file)) return parse_safetensors(file, path);
  const CheckpointFile checkpoint(file, path);
  SavedPolicy policy = checkpoint.policy();
  if (average) {
    PICTURA_CHECK(checkpoint.header.contains("average"),
                  "{}: holds no average of weights: expected a checkpoint of a run with train.weight_average", path);
    policy.parameters = checkpoint.tensors("average");
  }
  return policy;
}

SavedPolicy read_policy(const std::string& path, bool average) {
  return parse_policy(read_policy_file(path), path, average);
}

void write_policy(const std::string& path, const SavedPolicy& policy, WeightType type, const std::string& commit) {
  ordered_json metadata = {{"format", "pt"},
                           {"config", to_toml(policy.config)},
                           {"schema", schema_to_json(policy.config).dump()},
                           {"rig", rig_to_json(policy.rig).dump()},
                           {"backbone_hash", policy.backbone_hash},
                           {"update", std::to_string(policy.update)},
                           {"agent_steps", std::to_string(policy.agent_steps)},
                           {"commit", commit},
                           {"hash", kNoHash}};
  if (!policy.rate_factors.empty()) metadata["rate_factors"] = ordered_json(policy.rate_factors).dump();
  std::string file = safetensors(policy.parameters, type, metadata);
  const std::string hash = hash_of_file(file, std::string(kNoHash));
  file.replace(file.find(fmt::format(R"("hash":"{}")", kNoHash)) + 8, hash.size(), hash);
  write_file(path, file);
}

void check_finite(const std::string& path, const std::vector<NamedTensor>& saved) {
  for (const NamedTensor& parameter : saved) {
    PICTURA_CHECK(at::isfinite(parameter.value).all().item<bool>(),
                  "{}: parameter '{}': expected finite numbers, got infinities or NaN", path, parameter.name);
  }
}

void restore_tensors(const std::string& path, const std::vector<NamedTensor>& saved,
                     const std::vector<NamedTensor>& parameters) {
  check_finite(path, saved);
  const at::NoGradGuard no_grad;
  for (const NamedTensor& parameter : parameters) {
    const auto found = std::find_if(saved.begin(), saved.end(),
                                    [&](const NamedTensor& candidate) { return candidate.name == parameter.name; });
    PICTURA_CHECK(found != saved.end(), "{}: of another architecture: it has no parameter '{}'", path, parameter.name);
    PICTURA_CHECK(found->value.sizes() == parameter.value.sizes(),
                  "{}: of another architecture: parameter '{}': expected [{}], got [{}]", path, parameter.name,
                  fmt::join(parameter.value.sizes(), ", "), fmt::join(found->value.sizes(), ", "));
    at::Tensor target = parameter.value;
    target.copy_(found->value);
  }
  PICTURA_CHECK(saved.size() == parameters.size(), "{}: of another architecture: expected {} parameters, got {}", path,
                parameters.size(), saved.size());
}

void restore_policy(const SavedPolicy& saved, const Policy& policy) {
  const auto backbone = [](const std::string& hash) { return hash.empty() ? "\"conv\"" : "a program of hash " + hash; };
  PICTURA_CHECK(policy.backbone_hash() == saved.backbone_hash, "{}: policy.backbone: its policy has {}, expected {}",
                saved.path, backbone(saved.backbone_hash), backbone(policy.backbone_hash()));
  restore_tensors(saved.path, saved.parameters, policy.parameters());
}

void write_safetensors(const std::string& path, const std::vector<NamedTensor>& tensors,
                       const std::string& config_toml) {
  write_file(path, safetensors(tensors, WeightType::f32, {{"format", "pt"}, {"config", config_toml}}));
}

}  // namespace pictura
