#include "pictura/map/load_map.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <filesystem>
#include <optional>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/numbers.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/map/lanelet2/lanelet2.h"
#include "pictura/map/map_cache.h"
#include "pictura/map/map_copy.h"
#include "pictura/map/procedural/procedural_town.h"

namespace pictura {

namespace {

namespace fs = std::filesystem;

constexpr std::string_view kExtension = ".xodr", kLanelet2Extension = ".osm";
// Size of a CARLA file per crossing, for a procedural town with streets of default length.
constexpr double kFileBytesPerCrossing = 80e3;
// A motorway counts as this many crossings, plus one for each block along it.
constexpr double kCrossingsPerMotorway = 12;
constexpr std::size_t kMaxFile_bytes = std::size_t{1} << 29;

std::vector<fs::path> town_folders() { return {fs::path(map_folder()), fs::path(map_folder()) / "carla"}; }

/// Parts of a name FILE.osm[@LATITUDE,LONGITUDE].
struct Lanelet2Name {
  std::string path;
  std::optional<GeoPoint> origin;
};

/// Returns nothing for names of other maps. Throws UsageError, which names the map, if the text after the @ is not a
/// place.
std::optional<Lanelet2Name> parse_lanelet2_name(std::string_view name) {
  if (name.ends_with(kLanelet2Extension)) return Lanelet2Name{std::string(name), std::nullopt};
  const std::size_t at = name.rfind('@');
  if (at == std::string_view::npos || !name.substr(0, at).ends_with(kLanelet2Extension)) return std::nullopt;
  const std::string_view place = name.substr(at + 1);
  const std::size_t comma = std::min(place.find(','), place.size());
  const std::optional<double> latitude = parse_number(place.substr(0, comma));
  const std::optional<double> longitude = parse_number(place.substr(std::min(comma + 1, place.size())));
  if (!latitude || !longitude || *latitude < -80 || *latitude > 84 || std::abs(*longitude) > 180) {
    fail_usage(
        "map '{}': expected @LATITUDE,LONGITUDE in degrees behind the file, with -80 to 84 and -180 to 180, "
        "got '@{}'",
        name, place);
  }
  return Lanelet2Name{std::string(name.substr(0, at)), GeoPoint{*latitude, *longitude}};
}

/// Returns the file of a map that is not procedural. Throws UsageError if there is none.
std::string file_path_of(const std::string& name) {
  std::error_code error;
  if (const std::optional<Lanelet2Name> lanelet2 = parse_lanelet2_name(name)) return lanelet2->path;
  if (is_map_file(name)) return name;
  if (fs::exists(name, error) && !fs::is_directory(name, error)) {
    fail_usage("map '{}': expected a file that ends in {} or {}", name, kExtension, kLanelet2Extension);
  }
  if (!name.empty() && name.find('/') == std::string::npos) {
    for (const fs::path& folder : town_folders()) {
      const fs::path path = folder / (name + std::string(kExtension));
      if (fs::exists(path, error)) return path.string();
    }
  }
  const std::vector<std::string> towns = known_towns();
  std::vector<std::string> known = towns;
  std::vector<std::string> families;
  for (const TownFamily& family : town_families()) {
    known.emplace_back(family.name);
    families.push_back(fmt::format("{}[:SEED[:OPTIONS]]", family.name));
  }
  fail_usage("map '{}': expected an {} or {} file, {}, or a town in {}, which has {}{}", name, kExtension,
             kLanelet2Extension, fmt::join(families, ", "), map_folder(),
             towns.empty() ? "none: CARLA's towns are part of CARLA, as Maps/OpenDrive/*.xodr; generated towns need no "
                             "file (--map procedural:1)"
                           : fmt::format("{}", fmt::join(towns, ", ")),
             suggestion(name, known));
}

RoadMap load_file(const std::string& name, const OpenDriveOptions& options, const ImportProgress& progress,
                  LoadReport* report) {
  const std::string path = file_path_of(name);
  const std::optional<Lanelet2Name> lanelet2 = parse_lanelet2_name(name);
  report->source = path;
  std::string text = read_file(path, kMaxFile_bytes);
  const auto import = [&] {
    return lanelet2 ? parse_lanelet2(text, path, options, lanelet2->origin, progress)
                    : parse_opendrive(text, path, options, progress);
  };
  // With another origin, the file makes another map, so the origin is part of the cache path and key.
  const bool has_origin = lanelet2 && lanelet2->origin;
  const std::string cache_path = map_cache_path(has_origin ? name : path, options);
  if (cache_path.empty()) return import();
  const MapCacheKey key = map_cache_key(has_origin ? text + name.substr(path.size()) : text, options);
  try {
    if (const std::optional<std::string> cached = read_cached(cache_path)) {
      RoadMap map = decode_map(*cached, key, cache_path);
      map.name = fs::path(path).stem().string();  // the cached file may have been written for another link to the file
      report->cached = true;
      return map;
    }
  } catch (const Error& rejection) {
    report->cache_rejection = rejection.what();
  }
  RoadMap map = import();
  write_to_cache(cache_path, encode_map(map, key));
  return map;
}

}  // namespace

bool is_map_file(std::string_view name) {
  const std::string_view map = parse_map_copy(name).map;
  return !town_family_of(name) && (map.ends_with(kExtension) || parse_lanelet2_name(map));
}

std::vector<std::string> known_towns() {
  std::vector<std::string> names;
  for (const fs::path& folder : town_folders()) {
    std::error_code error;
    for (const fs::directory_entry& entry : fs::directory_iterator(folder, error)) {
      if (entry.path().extension() == kExtension) names.push_back(entry.path().stem().string());
    }
  }
  std::sort(names.begin(), names.end());
  names.erase(std::unique(names.begin(), names.end()), names.end());
  return names;
}

std::string map_folder() {
  auto variable = [](const char* name) -> std::string {
    const char* value = std::getenv(name);
    return value ? value : "";
  };
  if (const std::string data = variable("PICTURA_DATA"); !data.empty()) return data;
  if (const std::string data = variable("XDG_DATA_HOME"); !data.empty()) return data + "/pictura/maps";
  return variable("HOME") + "/.local/share/pictura/maps";
}

std::shared_ptr<const RoadMap> load_map(const std::string& name, const OpenDriveOptions& options,
                                        LoadReport* report_out, const ImportProgress& progress) {
  LoadReport unused;
  LoadReport& report = report_out ? *report_out : unused;
  report = {};
  const MapCopy asked = parse_map_copy(name);
  const std::string original(asked.map);
  OpenDriveOptions its_options = options;
  const auto set_plan = [&](const std::string& map_name) {
    if (asked.copy > 0) its_options.plan = draw_map_copy(map_name, asked.copy);
  };
  auto map = std::make_shared<RoadMap>();
  if (const std::optional<TownOptions> town = parse_town_name(original)) {
    report.source = original;
    const bool has_seed = original.find(':') != std::string::npos;
    const std::string map_name = has_seed ? original : fmt::format("{}:{}", original, town->seed);
    set_plan(map_name);
    *map = parse_opendrive(procedural_town(*town), original, its_options, progress);
    map->name = map_name;
  } else {
    set_plan(fs::path(file_path_of(original)).stem().string());
    *map = load_file(original, its_options, progress, &report);
  }
  if (asked.copy > 0) map->name = map_copy_name(map->name, asked.copy);
  return map;
}

std::vector<std::shared_ptr<const RoadMap>> load_maps(const std::vector<std::string>& names, int num_threads) {
  const InterruptibleWork work("interrupted while maps were loaded");
  std::vector<std::shared_ptr<const RoadMap>> maps(names.size());
  parallel_for(num_threads, static_cast<int64_t>(names.size()), [&](int64_t index) {
    work.check();
    const auto i = static_cast<std::size_t>(index);
    maps[i] = load_map(names[i]);
  });
  return maps;
}

int64_t map_file_bytes(const std::string& name) {
  const std::string original(parse_map_copy(name).map);
  if (const std::optional<TownOptions> town = parse_town_name(original)) {
    const double motorway = town->motorway > 0 ? kCrossingsPerMotorway + town->blocks_x + town->blocks_y : 0;
    const double crossings = (town->blocks_x + 1.0) * (town->blocks_y + 1.0) + motorway;
    return static_cast<int64_t>(kFileBytesPerCrossing * crossings * town->block_m / TownOptions().block_m);
  }
  std::error_code error;
  const std::uintmax_t bytes = fs::file_size(file_path_of(original), error);
  return error ? 0 : static_cast<int64_t>(bytes);  // loading reports an unreadable file
}

MapText map_text(const std::string& name) {
  if (parse_map_copy(name).copy > 0) {
    fail_usage("map '{}': expected a map with its own text, got a copy, which is deformed after reading", name);
  }
  if (const std::optional<TownOptions> town = parse_town_name(name)) return {procedural_town(*town), name};
  if (parse_lanelet2_name(name)) fail_usage("map '{}': expected an OpenDRIVE map, got one of Lanelet2", name);
  const std::string path = file_path_of(name);
  return {read_file(path, kMaxFile_bytes), path};
}

}  // namespace pictura
