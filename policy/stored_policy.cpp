#include "pictura/policy/stored_policy.h"

#include <algorithm>
#include <bit>
#include <cmath>
#include <cstring>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/json_text.h"
#include "pictura/policy/checkpoint_file.h"
#include "pictura/policy/policy_json.h"
#include "pictura/policy/safetensors.h"

namespace pictura {

namespace {

using nlohmann::ordered_json;

constexpr std::string_view kNoHash = "0000000000000000";
constexpr size_t kLengthBytes = sizeof(uint64_t);

// Converts a tensor to the form in which files store it.
SafeTensor safe_tensor(const StoredTensor& tensor, WeightType weights) {
  if (weights == WeightType::f32) {
    return {tensor.name,
            SafeType::f32,
            tensor.shape,
            {reinterpret_cast<const char*>(tensor.values.data()), tensor.values.size() * sizeof(float)}};
  }
  SafeTensor result{tensor.name, SafeType::bf16, tensor.shape, {}};
  result.bytes.resize(tensor.values.size() * sizeof(uint16_t));
  for (size_t i = 0; i < tensor.values.size(); ++i) {
    const uint16_t rounded = bf16_of(tensor.values[i]);
    std::memcpy(&result.bytes[i * sizeof rounded], &rounded, sizeof rounded);
  }
  return result;
}

// Returns the hash of the whole file with zeros in place of the digits of `hash` in the metadata. Returns an empty
// string if the metadata do not contain `hash`.
std::string hash_of_file(std::string file, const std::string& hash) {
  const std::string key = R"("hash":")";
  const size_t place = file.find(key + hash);
  if (hash.size() != kNoHash.size() || place == std::string::npos) return "";
  file.replace(place + key.size(), kNoHash.size(), kNoHash);
  return fmt::format("{:016x}", pictura::hash_of(file));
}

StoredTensor read_tensor(const std::string& name, const ordered_json& entry, std::string_view data,
                         const std::string& what) {
  const auto dtype = entry.at("dtype").get<std::string>();
  const bool is_f32 = dtype == name_of(SafeType::f32);
  PICTURA_CHECK(is_f32 || dtype == name_of(SafeType::bf16), "{}: dtype: expected F32 or BF16, got {}", what, dtype);
  StoredTensor result{name, entry.at("shape").get<std::vector<int64_t>>(), {}};
  const auto begin = entry.at("data_offsets").at(0).get<uint64_t>();
  const auto end = entry.at("data_offsets").at(1).get<uint64_t>();
  PICTURA_CHECK(begin <= end && end <= data.size(), "{}: data_offsets: expected a range within {} bytes, got {} to {}",
                what, data.size(), begin, end);
  const uint64_t of_one = is_f32 ? sizeof(float) : sizeof(uint16_t);
  uint64_t bytes = of_one;
  for (const int64_t size : result.shape) {
    PICTURA_CHECK(size > 0 && size <= static_cast<int64_t>(data.size()),
                  "{}: shape: expected sizes from 1 to {}, got {}", what, data.size(), size);
    bytes *= static_cast<uint64_t>(size);
    PICTURA_CHECK(bytes <= end - begin, "{}: shape: expected one of {} bytes, got more", what, end - begin);
  }
  PICTURA_CHECK(bytes == end - begin, "{}: shape: expected one of {} bytes, got {}", what, end - begin, bytes);
  result.values.resize(bytes / of_one);
  if (is_f32) {
    std::memcpy(result.values.data(), data.data() + begin, bytes);
    return result;
  }
  for (size_t i = 0; i < result.values.size(); ++i) {
    uint16_t stored = 0;
    std::memcpy(&stored, data.data() + begin + i * sizeof stored, sizeof stored);
    result.values[i] = std::bit_cast<float>(uint32_t{stored} << 16);
  }
  return result;
}

StoredPolicy parse_safetensors(const std::string& file, const std::string& path) {
  uint64_t length = 0;
  if (file.size() >= kLengthBytes) std::memcpy(&length, file.data(), sizeof length);
  PICTURA_CHECK(
      file.size() >= kLengthBytes && length <= file.size() - kLengthBytes,
      "{}: expected a checkpoint, which begins with PICTCKPT, or safetensors; got neither, or a truncated file", path);
  StoredPolicy result;
  result.path = path;
  try {
    const ordered_json header = parse_json(file.substr(kLengthBytes, length));
    const ordered_json metadata = header.value("__metadata__", ordered_json::object());
    PICTURA_CHECK(metadata.contains("config") && metadata.contains("schema"),
                  "{}: expected safetensors of a policy, written by training or `pictura export`: "
                  "its metadata lack 'config' or 'schema'",
                  path);
    const auto text = [&](const char* key) { return metadata.at(key).get<std::string>(); };
    PICTURA_CHECK(hash_of_file(file, text("hash")) == text("hash"),
                  "{}: damaged or truncated: its bytes do not match the hash in its metadata", path);
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
        result.parameters.push_back(read_tensor(name, entry, data, path + ": " + name));
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

StoredPolicy parse_stored_policy(const std::string& file, const std::string& path, bool average) {
  PICTURA_CHECK(!average || is_checkpoint(file),
                "{}: holds one set of weights: expected a checkpoint for the weight average", path);
  if (!is_checkpoint(file)) return parse_safetensors(file, path);
  const CheckpointFile checkpoint(file, path);
  StoredPolicy policy = checkpoint.policy();
  if (average) {
    PICTURA_CHECK(checkpoint.header.contains("average"),
                  "{}: holds no weight average: expected a checkpoint of a run with train.weight_average", path);
    policy.parameters = checkpoint.tensors("average");
  }
  return policy;
}

StoredPolicy read_stored_policy(const std::string& path, bool average) {
  return parse_stored_policy(read_policy_file(path), path, average);
}

void write_stored_policy(const std::string& path, const StoredPolicy& policy, WeightType type,
                         const std::string& commit) {
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
  std::vector<SafeTensor> tensors;
  for (const StoredTensor& parameter : policy.parameters) tensors.push_back(safe_tensor(parameter, type));
  std::string file = safetensors(tensors, metadata);
  const std::string hash = hash_of_file(file, std::string(kNoHash));
  file.replace(file.find(fmt::format(R"("hash":"{}")", kNoHash)) + 8, hash.size(), hash);
  write_file(path, file);
}

void check_finite(const std::string& path, const std::vector<StoredTensor>& saved) {
  for (const StoredTensor& parameter : saved) {
    PICTURA_CHECK(
        std::all_of(parameter.values.begin(), parameter.values.end(), [](float v) { return std::isfinite(v); }),
        "{}: parameter '{}': expected finite numbers, got infinities or NaN", path, parameter.name);
  }
}

void check_has_convolutions(const StoredPolicy& policy, std::string_view option) {
  if (!policy.config.reads_images()) fail_usage("{}: {}: its policy reads no images", policy.path, option);
  const std::string& backbone = policy.config.policy.backbone;
  if (backbone == "conv") return;
  fail_usage("{}: {}: its policy uses the program {} instead of convolutions", policy.path, option, backbone);
}

namespace {

template <typename Tensors>
auto& parameter_named(const std::string& path, Tensors& saved, const std::string& name) {
  const auto found = std::find_if(saved.begin(), saved.end(), [&](const StoredTensor& t) { return t.name == name; });
  PICTURA_CHECK(found != saved.end(), "{}: has a different architecture: no parameter '{}'", path, name);
  return *found;
}

}  // namespace

StoredTensor& find_parameter(StoredPolicy* policy, const std::string& name) {
  return parameter_named(policy->path, policy->parameters, name);
}

const StoredTensor& find_parameter(const std::string& path, const std::vector<StoredTensor>& saved,
                                   const std::string& name, const std::vector<int64_t>& shape) {
  const StoredTensor& found = parameter_named(path, saved, name);
  PICTURA_CHECK(found.shape == shape, "{}: has a different architecture: parameter '{}': expected [{}], got [{}]", path,
                name, fmt::join(shape, ", "), fmt::join(found.shape, ", "));
  return found;
}

void check_parameter_count(const std::string& path, size_t saved, size_t expected) {
  PICTURA_CHECK(saved == expected, "{}: has a different architecture: expected {} parameters, got {}", path, expected,
                saved);
}

std::string hash_of_parameters(const std::vector<StoredTensor>& parameters) {
  Hash64 hash;
  for (const StoredTensor& parameter : parameters) {
    hash.add_bytes(parameter.values.data(), parameter.values.size() * sizeof(float));
  }
  return hash.hex();
}

}  // namespace pictura
