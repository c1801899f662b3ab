#include "pictura/training/checkpoint.h"

#include <cstring>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/json.h"
#include "pictura/common/support/json_text.h"
#include "pictura/training/policy_json.h"

namespace pictura {

namespace {

using nlohmann::ordered_json;

constexpr char kMagic[8] = {'P', 'I', 'C', 'T', 'C', 'K', 'P', 'T'};
constexpr uint32_t kVersion = 2;
constexpr uint32_t kVersionHashingDataAlone = 1;
constexpr uint32_t kByteOrder = 0x01020304;
constexpr size_t kPreamble = sizeof(kMagic) + 2 * sizeof(uint32_t) + sizeof(uint64_t);

std::string bytes_of(const at::Tensor& tensor) {
  const at::Tensor host = tensor.detach().to(at::kCPU, at::kFloat).contiguous();
  return {static_cast<const char*>(host.const_data_ptr()), host.nbytes()};
}

template <typename T>
void append(std::string* bytes, T value) {
  bytes->append(reinterpret_cast<const char*>(&value), sizeof value);
}

template <typename T>
T at_offset(const std::string& bytes, size_t offset) {
  T value;
  std::memcpy(&value, bytes.data() + offset, sizeof value);
  return value;
}

std::string hash_text(std::string_view bytes) { return fmt::format("{:016x}", hash_of(bytes)); }

}  // namespace

void write_checkpoint(const std::string& path, const Checkpoint& checkpoint) {
  std::string data;
  auto describe = [&](const std::vector<NamedTensor>& tensors) {
    ordered_json list = ordered_json::array();
    for (const NamedTensor& tensor : tensors) {
      list.push_back({{"name", tensor.name}, {"shape", tensor.value.sizes().vec()}, {"offset", data.size()}});
      data += bytes_of(tensor.value);
    }
    return list;
  };
  ordered_json header;
  header["config"] = to_toml(checkpoint.config);
  header["schema"] = schema_to_json(checkpoint.config);
  header["rig"] = rig_to_json(checkpoint.rig);
  if (!checkpoint.backbone_hash.empty()) header["backbone"] = {{"hash", checkpoint.backbone_hash}};
  header["counters"] = {{"update", checkpoint.update},
                        {"agent_steps", checkpoint.agent_steps},
                        {"distance_m", checkpoint.distance_m},
                        {"adam_steps", checkpoint.adam_steps},
                        {"filter_average", checkpoint.filter_average}};
  header["recent"] = ordered_json::array();
  for (const RecentUpdate& r : checkpoint.recent) {
    header["recent"].push_back({{"finished", r.finished}, {"finished_return", r.finished_return}});
  }
  header["longest_update_s"] = checkpoint.longest_update_s;
  if (!checkpoint.rate_factors.empty()) header["rate_factors"] = checkpoint.rate_factors;
  header["parameters"] = describe(checkpoint.parameters);
  header["first_moments"] = describe(checkpoint.first_moments);
  header["second_moments"] = describe(checkpoint.second_moments);
  if (!checkpoint.average.empty()) {
    header["average"] = describe(checkpoint.average);
    header["counters"]["averaged_updates"] = checkpoint.averaged_updates;
  }
  header["simulator"] = {{"offset", data.size()}, {"bytes", checkpoint.simulator.size()}};
  data.append(reinterpret_cast<const char*>(checkpoint.simulator.data()), checkpoint.simulator.size());
  header["data"] = {{"bytes", data.size()}};

  const std::string text = json_text(header);
  std::string file(kMagic, sizeof kMagic);
  append(&file, kVersion);
  append(&file, kByteOrder);
  append(&file, static_cast<uint64_t>(text.size()));
  file += text;
  file += data;
  append(&file, hash_of(file));
  write_file(path, file);
}

bool is_checkpoint(std::string_view file) { return file.starts_with(std::string_view(kMagic, sizeof kMagic)); }

std::string read_checkpoint_file(const std::string& path) {
  return read_file(path, size_t{1} << 36, [&path](std::string_view first) {
    // Safetensors begin with the length of their header, which is JSON.
    uint64_t length = 0;
    const bool is_long = first.size() > sizeof length;
    if (is_long) std::memcpy(&length, first.data(), sizeof length);
    PICTURA_CHECK(is_checkpoint(first) || (is_long && length > 0 && first[sizeof length] == '{'),
                  "{}: expected a checkpoint, which begins with PICTCKPT, or safetensors; got neither, "
                  "or a truncated file",
                  path);
  });
}

Checkpoint read_checkpoint(const std::string& path) { return parse_checkpoint(read_checkpoint_file(path), path); }

Checkpoint parse_checkpoint(const std::string& file, const std::string& path) {
  PICTURA_CHECK(is_checkpoint(file), "{}: not a checkpoint: expected it to begin with PICTCKPT", path);
  PICTURA_CHECK(file.size() >= kPreamble, "{}: truncated: {} bytes", path, file.size());
  PICTURA_CHECK(at_offset<uint32_t>(file, 12) == kByteOrder, "{}: written on a machine of another byte order", path);
  const auto version = at_offset<uint32_t>(file, 8);
  PICTURA_CHECK(version == kVersion || version == kVersionHashingDataAlone,
                "{}: expected checkpoint version {} or {}, got {}", path, kVersionHashingDataAlone, kVersion, version);
  std::string_view content = file;  // without the hash
  if (version == kVersion) {
    PICTURA_CHECK(file.size() >= kPreamble + sizeof(uint64_t), "{}: truncated: {} bytes", path, file.size());
    content.remove_suffix(sizeof(uint64_t));
    PICTURA_CHECK(hash_of(content) == at_offset<uint64_t>(file, content.size()),
                  "{}: damaged or truncated: its bytes do not have the hash that it ends with", path);
  }
  const auto header_bytes = at_offset<uint64_t>(file, 16);
  PICTURA_CHECK(header_bytes <= content.size() - kPreamble, "{}: truncated: its header has {} bytes, the file {}", path,
                header_bytes, file.size());

  Checkpoint result;
  result.path = path;
  try {
    const ordered_json header = parse_json(content.substr(kPreamble, header_bytes));
    result.config = parse_saved_config(header.at("config").get<std::string>(), path + ": config");
    check_schema(header.at("schema"), result.config, path);
    const std::string_view data = content.substr(kPreamble + header_bytes);
    const auto data_bytes = header.at("data").at("bytes").get<uint64_t>();
    PICTURA_CHECK(data.size() == data_bytes, "{}: truncated: expected {} bytes of data, got {}", path, data_bytes,
                  data.size());
    PICTURA_CHECK(version == kVersion || hash_text(data) == header.at("data").at("hash").get<std::string>(),
                  "{}: damaged: its data do not have the hash that its header names", path);

    auto tensors = [&](const char* list) {
      std::vector<NamedTensor> all;
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
        at::Tensor value = at::empty(shape, at::kFloat);
        std::memcpy(value.data_ptr(), data.data() + offset, bytes);
        all.push_back({entry.at("name").get<std::string>(), value});
      }
      return all;
    };
    result.parameters = tensors("parameters");
    result.first_moments = tensors("first_moments");
    result.second_moments = tensors("second_moments");
    if (header.contains("average")) {
      result.average = tensors("average");
      result.averaged_updates = header.at("counters").at("averaged_updates");
    }
    const auto offset = header.at("simulator").at("offset").get<uint64_t>();
    const auto size = header.at("simulator").at("bytes").get<uint64_t>();
    PICTURA_CHECK(size <= data.size() && offset <= data.size() - size, "{}: simulator: bad offset", path);
    const auto* first = reinterpret_cast<const uint8_t*>(data.data()) + offset;
    result.simulator.assign(first, first + size);

    const ordered_json& counters = header.at("counters");
    result.update = counters.at("update");
    result.agent_steps = counters.at("agent_steps");
    result.distance_m = counters.at("distance_m");
    result.adam_steps = counters.at("adam_steps");
    result.filter_average = counters.at("filter_average");
    // A run saved without it continues exactly; only its averages start again.
    for (const ordered_json& json : header.value("recent", ordered_json::array())) {
      result.recent.push_back({json.at("finished"), json.at("finished_return")});
    }
    result.longest_update_s = header.value("longest_update_s", result.longest_update_s);
    result.rate_factors = header.value("rate_factors", result.rate_factors);
    result.rig = rig_from_json(header.at("rig"));
    if (header.contains("backbone")) result.backbone_hash = header["backbone"].at("hash");
  } catch (const nlohmann::json::exception& error) {
    fail("{}: its header cannot be read: {}", path, error.what());
  }
  return result;
}

std::string first_difference(const Rig& saved, const Rig& now) {
  if (saved.cameras.size() != now.cameras.size()) {
    return fmt::format("{} cameras became {}", saved.cameras.size(), now.cameras.size());
  }
  const ordered_json before = rig_to_json(saved), after = rig_to_json(now);
  for (size_t c = 0; c < before.size(); ++c) {
    for (const auto& [property, value] : before[c].items()) {
      const ordered_json& other = after[c].at(property);
      if (value != other) {
        return fmt::format("camera '{}': {}: {} became {}", saved.cameras[c].name, property, value.dump(),
                           other.dump());
      }
    }
  }
  return "";
}

}  // namespace pictura
