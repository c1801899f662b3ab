#include "pictura/map/map_cache.h"

#include <algorithm>
#include <array>
#include <cstring>
#include <filesystem>
#include <type_traits>
#include <utility>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/map/map_fields.h"
#include "pictura/map_fingerprint.h"

namespace pictura {

namespace {

constexpr std::array<char, 8> kMagic{'P', 'I', 'C', 'T', 'R', 'M', 'A', 'P'};
constexpr uint32_t kVersion = 1;  // of the header; the payload format is covered by the importer hash
constexpr uint32_t kByteOrder = 0x01020304;

struct Header {
  std::array<char, 8> magic = kMagic;
  uint32_t version = kVersion, byte_order = kByteOrder;
  MapCacheKey key;
  uint64_t payload_bytes = 0, payload_hash = 0;
};
static_assert(std::has_unique_object_representations_v<Header>, "the header must have no padding");

template <typename T>
using FieldsOf = decltype(fields_of(std::declval<T&>()));
template <typename T>
concept HasFields = requires(T& value) { fields_of(value); };
template <typename T>
concept IsNumber = std::is_arithmetic_v<T> && !std::is_same_v<T, bool>;
template <typename T>
constexpr bool kIsVector = false;
template <typename T>
constexpr bool kIsVector<std::vector<T>> = true;

/// Whether a T's bytes in memory equal those in the file and any bit pattern is valid: only numbers, no padding.
template <typename T>
constexpr bool is_plain() {
  if constexpr (HasFields<T>) {
    return []<typename... F>(std::type_identity<std::tuple<F&...>>) {
      return (is_plain<F>() && ...) && (sizeof(F) + ...) == sizeof(T);
    }(std::type_identity<FieldsOf<T>>());
  } else {
    return IsNumber<T>;
  }
}
static_assert(is_plain<LanePoint>() && is_plain<RoadEdge>() && !is_plain<Lane>() && !is_plain<Sign>());

/// The minimum size of a T in the file.
template <typename T>
constexpr uint64_t min_bytes() {
  if constexpr (HasFields<T>) {
    return []<typename... F>(std::type_identity<std::tuple<F&...>>) {
      return (min_bytes<F>() + ...);
    }(std::type_identity<FieldsOf<T>>());
  } else if constexpr (kIsVector<T> || std::is_same_v<T, std::string>) {
    return sizeof(uint64_t);
  } else {
    return sizeof(T);
  }
}

class Writer {
 public:
  explicit Writer(std::string* bytes) : bytes_(bytes) {}

  template <typename T>
  void put(const T& value) {
    if constexpr (HasFields<T>) {
      std::apply([&](const auto&... field) { (put(field), ...); }, fields_of(value));
    } else if constexpr (kIsVector<T> || std::is_same_v<T, std::string>) {
      put(uint64_t{value.size()});
      put_items(value.data(), value.size());
    } else if constexpr (std::is_scalar_v<T>) {
      put_bytes(&value, sizeof value);
    } else {
      put_items(value.data(), value.size());
    }
  }

 private:
  template <typename T>
  void put_items(const T* items, std::size_t count) {
    if constexpr (is_plain<T>()) {
      put_bytes(items, count * sizeof(T));
    } else {
      for (std::size_t i = 0; i < count; ++i) put(items[i]);
    }
  }
  void put_bytes(const void* data, std::size_t size) { bytes_->append(static_cast<const char*>(data), size); }

  std::string* bytes_;
};

class Reader {
 public:
  explicit Reader(std::string_view bytes) : rest_(bytes) {}

  template <typename T>
  void get(T* value_out) {
    if constexpr (HasFields<T>) {
      std::apply([&](auto&... field) { (get(&field), ...); }, fields_of(*value_out));
    } else if constexpr (kIsVector<T> || std::is_same_v<T, std::string>) {
      using Item = typename T::value_type;
      uint64_t count = 0;
      get(&count);
      PICTURA_CHECK(count <= rest_.size() / min_bytes<Item>(),
                    "damaged: a size of {} elements of at least {} bytes, where {} bytes are left", count,
                    min_bytes<Item>(), rest_.size());
      value_out->resize(static_cast<std::size_t>(count));
      get_items(value_out->data(), value_out->size());
    } else if constexpr (std::is_same_v<T, bool>) {
      uint8_t byte = 0;
      get(&byte);
      PICTURA_CHECK(byte <= 1, "damaged: expected 0 or 1 for a bool, got {}", byte);
      *value_out = byte != 0;
    } else if constexpr (std::is_enum_v<T>) {
      get_bytes(value_out, sizeof(T));
      PICTURA_CHECK(is_known(*value_out), "damaged: no enumerator has the number {}",
                    static_cast<std::underlying_type_t<T>>(*value_out));
    } else if constexpr (std::is_scalar_v<T>) {
      get_bytes(value_out, sizeof(T));
    } else {
      get_items(value_out->data(), value_out->size());
    }
  }

  void expect_end() const {
    PICTURA_CHECK(rest_.empty(), "damaged: {} bytes are left after the last element", rest_.size());
  }

 private:
  template <typename T>
  void get_items(T* items, std::size_t count) {
    if constexpr (is_plain<T>()) {
      get_bytes(items, count * sizeof(T));
    } else {
      for (std::size_t i = 0; i < count; ++i) get(&items[i]);
    }
  }
  void get_bytes(void* out, std::size_t size) {
    PICTURA_CHECK(size <= rest_.size(), "damaged: expected {} bytes more, {} are left", size, rest_.size());
    if (size > 0) std::memcpy(out, rest_.data(), size);
    rest_.remove_prefix(size);
  }
  template <typename Enum>
  static bool is_known(Enum value) {
    return std::string_view(to_string(value)) != "unknown";
  }

  std::string_view rest_;
};

/// Checks the header and returns the payload.
std::string_view checked_payload(std::string_view bytes, const MapCacheKey& key) {
  Header header;
  const std::size_t magic_bytes = std::min(bytes.size(), kMagic.size());
  PICTURA_CHECK(bytes.substr(0, magic_bytes) == std::string_view(kMagic.data(), magic_bytes),
                "foreign: expected it to begin with {}", std::string_view(kMagic.data(), kMagic.size()));
  PICTURA_CHECK(bytes.size() >= sizeof header, "truncated: {} bytes, expected at least {} for the header", bytes.size(),
                sizeof header);
  std::memcpy(&header, bytes.data(), sizeof header);
  PICTURA_CHECK(header.byte_order == kByteOrder, "written on a machine of another byte order");
  PICTURA_CHECK(header.version == kVersion, "expected version {}, got {}", kVersion, header.version);
  PICTURA_CHECK(header.key.importer == key.importer, "stale: made by another version of the importer");
  PICTURA_CHECK(header.key.source == key.source, "stale: the map file has changed");
  PICTURA_CHECK(header.key.options == key.options, "stale: made with other options");
  const std::string_view payload = bytes.substr(sizeof header);
  PICTURA_CHECK(header.payload_bytes <= payload.size(), "truncated: expected {} bytes after the header, got {}",
                header.payload_bytes, payload.size());
  PICTURA_CHECK(header.payload_bytes == payload.size(), "damaged: expected {} bytes after the header, got {}",
                header.payload_bytes, payload.size());
  PICTURA_CHECK(header.payload_hash == hash_of(payload), "damaged: its bytes do not have the hash in its header");
  return payload;
}

}  // namespace

MapCacheKey map_cache_key(std::string_view source_bytes, const OpenDriveOptions& options) {
  std::string option_bytes;
  Writer(&option_bytes).put(options);
  return {.importer = PICTURA_MAP_FINGERPRINT, .source = hash_of(source_bytes), .options = hash_of(option_bytes)};
}

std::string map_cache_header(std::string_view payload, const MapCacheKey& key) {
  const Header header{.key = key, .payload_bytes = payload.size(), .payload_hash = hash_of(payload)};
  return {reinterpret_cast<const char*>(&header), sizeof header};
}

std::string encode_map(const RoadMap& map, const MapCacheKey& key) {
  std::string payload;
  Writer(&payload).put(map);
  return map_cache_header(payload, key) + payload;
}

RoadMap decode_map(std::string_view bytes, const MapCacheKey& key, const std::string& name) {
  try {
    Reader reader(checked_payload(bytes, key));
    RoadMap map;
    reader.get(&map);
    reader.expect_end();
    validate(map);
    return map;
  } catch (const Error& error) {
    fail("{}: {}", name, error.what());
  }
}

std::string map_cache_path(const std::string& source_path, const OpenDriveOptions& options) {
  const std::string folder = cache_folder("maps");
  if (folder.empty()) return "";
  std::error_code error;
  const std::filesystem::path source = std::filesystem::weakly_canonical(source_path, error);
  const uint64_t path_hash = hash_of(source.string() + fmt::format(" {:x}", map_cache_key("", options).options));
  return fmt::format("{}/{}-{:016x}.map", folder, source.stem().string(), path_hash);
}

}  // namespace pictura
