#include "pictura/policy/safetensors.h"

#include "pictura/common/support/json_text.h"

namespace pictura {

static_assert(std::endian::native == std::endian::little, "safetensors are little endian");

std::string_view name_of(SafeType type) {
  constexpr std::string_view kNames[] = {"F32", "BF16", "I64"};
  return kNames[static_cast<size_t>(type)];
}

std::string safetensors(const std::vector<SafeTensor>& tensors, const nlohmann::ordered_json& metadata) {
  std::string data;
  nlohmann::ordered_json header;
  header["__metadata__"] = metadata;
  for (const SafeTensor& tensor : tensors) {
    const size_t begin = data.size();
    data += tensor.bytes;
    header[tensor.name] = {
        {"dtype", name_of(tensor.type)}, {"shape", tensor.shape}, {"data_offsets", {begin, data.size()}}};
  }
  std::string text = json_text(header);
  text.append((8 - text.size() % 8) % 8, ' ');  // padding, so that the data begin at a multiple of 8 bytes
  const uint64_t length = text.size();
  const std::string file(reinterpret_cast<const char*>(&length), sizeof length);
  return file + text + data;
}

}  // namespace pictura
