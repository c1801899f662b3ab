#include "pictura/policy/checkpoint_file.h"

#include <cstring>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/json_text.h"
#include "pictura/policy/policy_json.h"

namespace pictura {

namespace {

using nlohmann::ordered_json;

constexpr char kMagic[8] = {'P', 'I', 'C', 'T', 'C', 'K', 'P', 'T'};
constexpr uint32_t kVersion = 2;
constexpr uint32_t kVersionHashingDataAlone = 1;
constexpr uint32_t kByteOrder = 0x01020304;
constexpr size_t kPreamble = sizeof(kMagic) + 2 * sizeof(uint32_t) + sizeof(uint64_t);

template <typename T>
void append(std::string* bytes, T value) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <typename T>
T at_offset(std::string_view bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

}  // namespace

bool is_checkpoint(std::string_view file) { return file.starts_with(std::string_view(kMagic, sizeof kMagic)); }

CheckpointFile::CheckpointFile(std::string_view file, const std::string& its_path) : path(its_path) {
  PICTURA_CHECK(is_checkpoint(file), "{}: not a checkpoint: expected it to begin with PICTCKPT", path);
  PICTURA_CHECK(file.size() >= kPreamble, "{}: truncated: {} bytes", path, file.size());
  PICTURA_CHECK(at_offset<uint32_t>(file, 12) == kByteOrder, "{}: written on a machine with a different byte order",
                path);
  const auto version = at_offset<uint32_t>(file, 8);
  PICTURA_CHECK(version == kVersion || version == kVersionHashingDataAlone,
                "{}: expected checkpoint version {} or {}, got {}", path, kVersionHashingDataAlone, kVersion, version);
  std::string_view content = file;  // without the hash at the end
  if (version == kVersion) {
    PICTURA_CHECK(file.size() >= kPreamble + sizeof(uint64_t), "{}: truncated: {} bytes", path, file.size());
    content.remove_suffix(sizeof(uint64_t));
    PICTURA_CHECK(hash_of(content) == at_offset<uint64_t>(file, content.size()),
                  "{}: damaged or truncated: its bytes do not match the hash at its end", path);
  }
  const auto header_bytes = at_offset<uint64_t>(file, 16);
  PICTURA_CHECK(header_bytes <= content.size() - kPreamble, "{}: truncated: its header has {} bytes, the file {}", path,
                header_bytes, file.size());
  read_header(path, [&] { header = parse_json(content.substr(kPreamble, header_bytes)); });
  read_header(path, [&] {
    data = content.substr(kPreamble + header_bytes);
    const auto data_bytes = header.at("data").at("bytes").get<uint64_t>();
    PICTURA_CHECK(data.size() == data_bytes, "{}: truncated: expected {} bytes of data, got {}", path, data_bytes,
                  data.size());
    PICTURA_CHECK(
        version == kVersion || fmt::format("{:016x}", hash_of(data)) == header.at("data").at("hash").get<std::string>(),
        "{}: damaged: its data do not match the hash in its header", path);
  });
}

std::vector<StoredTensor> CheckpointFile::tensors(const char* list) const {
  return read_header(path, [&] {
    std::vector<StoredTensor> all;
    for (const ordered_json& entry : header.at(list)) {
      const auto shape = entry.at("shape").get<std::vector<int64_t>>();
      const auto offset = entry.at("offset").get<uint64_t>();
      uint64_t bytes = sizeof(float);
      for (const int64_t size : shape) {
        PICTURA_CHECK(size > 0 && size <= static_cast<int64_t>(data.size()), "{}: {}: bad shape", path, list);
        bytes *= static_cast<uint64_t>(size);
        PICTURA_CHECK(bytes <= data.size(), "{}: {}: bad shape", path, list);
      }
      PICTURA_CHECK(bytes <= data.size() && offset <= data.size() - bytes, "{}: {}: bad offset", path, list);
      StoredTensor tensor{entry.at("name").get<std::string>(), shape, std::vector<float>(bytes / sizeof(float))};
      std::memcpy(tensor.values.data(), data.data() + offset, bytes);
      all.push_back(std::move(tensor));
    }
    return all;
  });
}

std::string_view CheckpointFile::bytes(const char* entry) const {
  return read_header(path, [&] {
    const auto offset = header.at(entry).at("offset").get<uint64_t>();
    const auto size = header.at(entry).at("bytes").get<uint64_t>();
    PICTURA_CHECK(size <= data.size() && offset <= data.size() - size, "{}: {}: bad offset", path, entry);
    return data.substr(offset, size);
  });
}

StoredPolicy CheckpointFile::policy() const {
  return read_header(path, [&] {
    StoredPolicy result;
    result.path = path;
    result.config = parse_saved_config(header.at("config").get<std::string>(), path + ": config");
    check_schema(header.at("schema"), result.config, path);
    result.parameters = tensors("parameters");
    result.update = header.at("counters").at("update");
    result.agent_steps = header.at("counters").at("agent_steps");
    result.rate_factors = header.value("rate_factors", result.rate_factors);
    result.rig = rig_from_json(header.at("rig"));
    if (header.contains("backbone")) result.backbone_hash = header["backbone"].at("hash");
    return result;
  });
}

void CheckpointWriter::add_policy(const PolicyFacts& policy) {
  header["config"] = to_toml(policy.config);
  header["schema"] = schema_to_json(policy.config);
  header["rig"] = rig_to_json(policy.rig);
  if (!policy.backbone_hash.empty()) header["backbone"] = {{"hash", policy.backbone_hash}};
  header["counters"] = {{"update", policy.update}, {"agent_steps", policy.agent_steps}};
}

void CheckpointWriter::add_weights(const StoredPolicy& policy) {
  if (!policy.rate_factors.empty()) header["rate_factors"] = policy.rate_factors;
  add_tensors("parameters", policy.parameters);
}

void CheckpointWriter::add_tensors(const char* list, const std::vector<StoredTensor>& tensors) {
  ordered_json& entries = header[list] = ordered_json::array();
  for (const StoredTensor& tensor : tensors) {
    entries.push_back({{"name", tensor.name}, {"shape", tensor.shape}, {"offset", data.size()}});
    data.append(reinterpret_cast<const char*>(tensor.values.data()), tensor.values.size() * sizeof(float));
  }
}

void CheckpointWriter::add_bytes(const char* entry, std::string_view bytes) {
  header[entry] = {{"offset", data.size()}, {"bytes", bytes.size()}};
  data += bytes;
}

std::string CheckpointWriter::finish() {
  header["data"] = {{"bytes", data.size()}};
  const std::string text = json_text(header);
  std::string file(kMagic, sizeof kMagic);
  append(&file, kVersion);
  append(&file, kByteOrder);
  append(&file, static_cast<uint64_t>(text.size()));
  file += text;
  file += data;
  append(&file, hash_of(file));
  return file;
}

}  // namespace pictura
