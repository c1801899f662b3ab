#include "pictura/replay/gallery.h"

#include <algorithm>
#include <filesystem>
#include <set>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/replay/file.h"
#include "pictura/replay/page_sources.h"
#include "pictura/replay/template.h"

namespace pictura {

namespace {

using Json = nlohmann::ordered_json;

constexpr const char* kIndex = "index.html";
constexpr const char* kIndexElement = R"(id="entries">)";  // identifies index pages of galleries

int64_t infractions_of(const Json& header) {
  int64_t sum = 0;
  for (const char* name : {"collisions", "off_road", "red_light", "wall_contacts"}) {
    sum += header.at("metrics").at(name).get<int64_t>();
  }
  return sum;
}

// Returns the index entries of all pages in the folder that are not in `without`, in the order of their names.
std::vector<Json> entries_of(const std::string& folder, const std::set<std::string>& without = {}) {
  PICTURA_CHECK(std::filesystem::is_directory(folder), "{}: expected a folder of replays", folder);
  std::vector<std::string> names;
  for (const auto& entry : std::filesystem::directory_iterator(folder)) {
    const std::string name = entry.path().filename().string();
    const bool is_page = entry.path().extension() == ".html" && name != kIndex;
    if (is_page && !without.contains(name)) names.push_back(name);
  }
  std::sort(names.begin(), names.end());
  std::vector<Json> entries;
  for (const std::string& name : names) {
    const std::string path = (std::filesystem::path(folder) / name).string();
    const Json header = read_replay_header(path);
    Json entry{{"file", name}};
    try {
      for (const char* key :
           {"map", "policy", "seed", "global_world", "agents", "frames", "dt_s", "metrics", "first_infraction"}) {
        entry[key] = header.at(key);
      }
      entry["infractions"] = infractions_of(header);
    } catch (const Json::exception&) {
      fail("{}: expected a replay's header, got a header with a missing value", path);
    }
    entries.push_back(std::move(entry));
  }
  return entries;
}

// Throws Error if the folder has an index.html that is not an index of replays, because such a file must not be
// overwritten.
void check_index(const std::string& folder) {
  const std::string index = (std::filesystem::path(folder) / kIndex).string();
  if (!std::filesystem::exists(index)) return;
  PICTURA_CHECK(read_file(index).find(kIndexElement) != std::string::npos,
                "{}: expected an index of replays, or none: otherwise another page would be overwritten", index);
}

}  // namespace

void check_gallery(const std::string& folder) {
  entries_of(folder, filled_files(folder, "gallery"));
  check_index(folder);
}

int write_gallery(const std::string& folder) {
  std::vector<Json> entries = entries_of(folder);
  check_index(folder);
  std::stable_sort(entries.begin(), entries.end(), [](const Json& a, const Json& b) {
    return a.at("infractions").get<int64_t>() > b.at("infractions").get<int64_t>();
  });
  write_file((std::filesystem::path(folder) / kIndex).string(),
             fill_template(page::gallery_html(), {{"entries", script_text(Json(entries))}}));
  return static_cast<int>(entries.size());
}

}  // namespace pictura
