#include "pictura/map/scenario/load_scenario.h"

#include <algorithm>
#include <filesystem>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/hash.h"
#include "pictura/common/support/numbers.h"
#include "pictura/map/field_codec.h"
#include "pictura/map/gpudrive/gpudrive.h"
#include "pictura/map/map_fields.h"
#include "pictura/map/pufferdrive/pufferdrive.h"
#include "pictura/map/scenario/logged_scene.h"
#include "pictura/map/scenario/scene_cache.h"
#include "pictura/map/scenario/scene_file.h"
#include "pictura/map/womd/womd.h"

namespace pictura {

namespace fs = std::filesystem;

/// Ids of the records of a TFRecord file. They are cached, because finding them is slow.
struct ShardIds {
  std::vector<std::string> of_records;
};

PICTURA_FIELDS(ShardIds, of_records)

namespace {

enum class SceneFormat { none, womd, gpudrive, pufferdrive, own };

constexpr std::size_t kMaxJson_bytes = std::size_t{1} << 26, kMaxBinary_bytes = std::size_t{1} << 28;
constexpr std::string_view kShard = ".tfrecord";

SceneFormat format_of(std::string_view path) {
  const std::string name = fs::path(path).filename().string();
  if (name.ends_with(".json")) return SceneFormat::gpudrive;
  if (name.ends_with(".bin")) return SceneFormat::pufferdrive;
  if (name.ends_with(kSceneFileEnding)) return SceneFormat::own;
  // Files of WOMD are named NAME.tfrecord-00000-of-00150. GPUDrive's JSON files, which are tested above, have names
  // that begin with tfrecord.
  if (name.find(kShard) != std::string::npos) return SceneFormat::womd;
  return SceneFormat::none;
}

struct SceneName {
  std::string path, selector;
};

/// Splits a name at its last #, unless a file has the whole name.
SceneName split(std::string_view name) {
  std::error_code error;
  const std::size_t mark = name.rfind('#');
  if (mark == std::string_view::npos || fs::exists(name, error)) return {std::string(name), ""};
  return {std::string(name.substr(0, mark)), std::string(name.substr(mark + 1))};
}

uint64_t hash_of_path(const std::string& path) {
  std::error_code error;
  return hash_of(fs::weakly_canonical(path, error).string());
}

ShardIds scan_ids(const womd::ByteSource& file, const std::vector<womd::RecordPlace>& records) {
  ShardIds ids;
  for (const womd::RecordPlace& place : records) {
    std::string& id = ids.of_records.emplace_back();
    try {
      id = womd::scan_scenario_id(file, place);
    } catch (const FieldError&) {
      // The fault is reported when the record is read.
    }
  }
  return ids;
}

/// Returns the ids of the records of a TFRecord file. They are cached while the lengths and checksums of the records do
/// not change.
ShardIds find_ids(const std::string& path, const womd::ByteSource& file,
                  const std::vector<womd::RecordPlace>& records) {
  const std::string folder = cache_folder("scenes");
  if (folder.empty()) return scan_ids(file, records);
  const std::string cached = fmt::format("{}/{:016x}.index", folder, hash_of_path(path));
  Hash64 content;
  for (const womd::RecordPlace& place : records) {
    content.add_bytes(&place.bytes, sizeof place.bytes);
    content.add_bytes(&place.sum, sizeof place.sum);
  }
  const SceneCacheKey key{.content = content.value(), .record = SceneCacheKey::kIndex};
  try {
    if (const std::optional<std::string> bytes = read_cached(cached)) {
      ShardIds ids;
      decode_cached(*bytes, key, cached, [&](FieldReader* reader) { reader->get(&ids); });
      if (ids.of_records.size() == records.size()) return ids;
    }
  } catch (const Error&) {
    // A stale or damaged cache file is replaced.
  }
  ShardIds ids = scan_ids(file, records);
  write_to_cache(cached, encode_cached(key, [&](FieldWriter* writer) { writer->put(ids); }));
  return ids;
}

void append_scenes(const std::string& path, SceneIndex* index_out) {
  if (format_of(path) != SceneFormat::womd) {
    index_out->scenes.push_back({.file = path});
    return;
  }
  const womd::FileBytes file(path);
  womd::RecordList list = womd::list_records(file, path);
  ShardIds ids = find_ids(path, file, list.records);
  for (std::size_t k = 0; k < list.records.size(); ++k) {
    const womd::RecordPlace& place = list.records[k];
    index_out->scenes.push_back(
        {path, static_cast<int32_t>(k), place.offset, place.bytes, std::move(ids.of_records[k])});
  }
  if (!list.fault.empty()) index_out->faults.push_back(std::move(list.fault));
}

LoggedScene parse(std::string_view bytes, const std::string& name) {
  switch (format_of(name)) {
    case SceneFormat::gpudrive: return gpudrive::parse_scene(bytes, name);
    case SceneFormat::pufferdrive: return pufferdrive::parse_scene(bytes, name);
    default: break;
  }
  fail_usage("{}: expected a scene: FILE.json, FILE.bin, FILE{} or a file with {} in its name", name, kSceneFileEnding,
             kShard);
}

/// Returns the bytes of the scene's record or file.
std::string read_scene(const SceneRef& scene) {
  if (scene.record >= 0) {
    const womd::FileBytes file(scene.file);
    return womd::read_record(file, scene.file, static_cast<std::size_t>(scene.record), {scene.offset, scene.bytes});
  }
  return read_file(scene.file, format_of(scene.file) == SceneFormat::gpudrive ? kMaxJson_bytes : kMaxBinary_bytes);
}

Scenario import_scene(const SceneRef& scene, std::string_view bytes) {
  if (scene.record < 0) return make_scenario(parse(bytes, scene.file));
  return make_scenario(womd::parse_scenario(bytes, fmt::format("{}: record {}", scene.file, scene.record)));
}

/// Returns the scenario_id of a file that is one scene, or an empty text if the file cannot be read.
std::string id_of_file(const SceneRef& scene) {
  try {
    return load_scenario(scene).id;
  } catch (const Error&) {
    return "";  // the fault is reported when the scene is loaded
  }
}

}  // namespace

bool is_scene_name(std::string_view name) {
  const SceneName scene = split(name);
  std::error_code error;
  return format_of(scene.path) != SceneFormat::none || fs::is_directory(scene.path, error);
}

SceneIndex index_scenes(const std::string& path) {
  SceneIndex index;
  std::error_code error;
  if (!fs::is_directory(path, error)) {
    PICTURA_CHECK(fs::exists(path, error), "{}: no such file or folder", path);
    append_scenes(path, &index);
    return index;
  }
  std::vector<std::string> files;
  for (const fs::directory_entry& entry : fs::directory_iterator(path, error)) {
    std::error_code ignored;
    if (entry.is_directory(ignored)) continue;
    if (format_of(entry.path().string()) != SceneFormat::none) files.push_back(entry.path().string());
  }
  PICTURA_CHECK(!error, "{}: the folder cannot be read: {}", path, error.message());
  PICTURA_CHECK(!files.empty(), "{}: expected scenes (.json, .bin, {} or {} files) in the folder, got none", path,
                kSceneFileEnding, kShard);
  std::sort(files.begin(), files.end());
  for (const std::string& file : files) {
    try {
      append_scenes(file, &index);
    } catch (const Error& fault) {
      index.faults.emplace_back(fault.what());
    }
  }
  return index;
}

SceneIndex find_scenes(const std::string& name) {
  const SceneName wanted = split(name);
  return wanted.selector.empty() ? index_scenes(wanted.path) : SceneIndex{{find_scene(name)}, {}};
}

SceneRef find_scene(const std::string& name) {
  const SceneName wanted = split(name);
  SceneIndex index = index_scenes(wanted.path);
  if (index.scenes.empty()) {
    fail("{}", index.faults.empty() ? fmt::format("{}: holds no scene", wanted.path) : index.faults.front());
  }
  if (wanted.selector.empty()) return index.scenes.front();
  for (const SceneRef& scene : index.scenes) {
    if (scene.id == wanted.selector) return scene;
  }
  if (const std::optional<uint64_t> number = parse_unsigned(wanted.selector)) {
    if (*number < index.scenes.size()) return index.scenes[*number];
  }
  for (const SceneRef& scene : index.scenes) {
    if (scene.record < 0 && id_of_file(scene) == wanted.selector) return scene;
  }
  // The message contains the first fault, because the requested record may be in an omitted end of the file.
  fail_usage("{}: expected #0 to #{} or the id of one of its scenes, got #{}{}", wanted.path, index.scenes.size() - 1,
             wanted.selector, index.faults.empty() ? "" : fmt::format(" ({})", index.faults.front()));
}

Scenario load_scenario(const SceneRef& scene, SceneReport* report_out) {
  SceneReport unused;
  SceneReport& report = report_out ? *report_out : unused;
  report = {};
  // Native files are as fast to read as the cache.
  if (format_of(scene.file) == SceneFormat::own) return parse_scene_file(read_file(scene.file), scene.file);
  const std::string bytes = read_scene(scene), folder = cache_folder("scenes");
  if (folder.empty()) return import_scene(scene, bytes);
  const std::string cached =
      fmt::format("{}/{:016x}/{}.scene", folder, hash_of_path(scene.file), std::max(scene.record, 0));
  const SceneCacheKey key{.content = hash_of(bytes), .record = scene.record};
  try {
    if (const std::optional<std::string> encoded = read_cached(cached)) {
      Scenario scenario = decode_scenario(*encoded, key, cached);
      // Maps of files without records are called as the file, of which another link may have been cached.
      if (scene.record < 0) scenario.map.name = fs::path(scene.file).stem().string();
      report.cached = true;
      return scenario;
    }
  } catch (const Error& rejection) {
    report.cache_rejection = rejection.what();
  }
  Scenario scenario = import_scene(scene, bytes);
  write_to_cache(cached, encode_scenario(scenario, key));
  return scenario;
}

Scenario load_scenario(const std::string& name, SceneReport* report_out) {
  return load_scenario(find_scene(name), report_out);
}

Scenario parse_scenario_file(std::string_view bytes, const std::string& name, int32_t record) {
  if (format_of(name) == SceneFormat::own) return parse_scene_file(bytes, name);
  if (format_of(name) != SceneFormat::womd) return make_scenario(parse(bytes, name));
  const womd::MemoryBytes file(bytes);
  const womd::RecordList list = womd::list_records(file, name);
  const auto k = static_cast<std::size_t>(record);
  if (k >= list.records.size()) {
    if (!list.fault.empty()) throw Error(list.fault);
    fail("{}: expected a record {}, got {} records", name, record, list.records.size());
  }
  const std::string payload = womd::read_record(file, name, k, list.records[k]);
  return make_scenario(womd::parse_scenario(payload, fmt::format("{}: record {}", name, record)));
}

}  // namespace pictura
