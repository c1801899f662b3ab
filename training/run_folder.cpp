#include "pictura/training/run_folder.h"

#include <algorithm>
#include <filesystem>
#include <regex>
#include <system_error>

#include <fmt/format.h>

#include "pictura/common/error.h"
#include "pictura/common/support/output_file.h"

namespace pictura {

namespace fs = std::filesystem;

std::vector<std::string> run_files(const std::string& folder) {
  static const std::regex kNames(
      R"(config\.toml|(untrained|checkpoint(\.(\d+|next))?|milestone_\d+[kM]?)\.ckpt|(policy|policy_average|failed_minibatch)\.safetensors|)"
      R"((progress|evaluation)\.csv(\.\d+)?|)"
      R"(events\.out\.tfevents\.\d+\.\d+|learning_curve\.png)");
  std::vector<std::string> names;
  for (const fs::directory_entry& entry : fs::directory_iterator(folder)) {
    std::string name = entry.path().filename().string();
    // A killed process leaves temporary files.
    if (!std::regex_match(name, kNames) && !is_temporary_name(name)) continue;
    PICTURA_CHECK(!entry.is_symlink(), "{}/{}: expected a run's own file, got a link", folder, name);
    if (entry.is_regular_file()) names.push_back(std::move(name));
  }
  std::sort(names.begin(), names.end());
  return names;
}

void save_checkpoint(const std::string& folder, int64_t num_kept,
                     const std::function<void(const std::string& path)>& save) {
  const auto path = [&](int64_t age) {
    return age == 0 ? folder + "/checkpoint.ckpt" : fmt::format("{}/checkpoint.{}.ckpt", folder, age);
  };
  const std::string next = folder + "/checkpoint.next.ckpt";
  save(next);
  for (int64_t age = num_kept; fs::exists(path(age)); ++age) fs::remove(path(age));
  for (int64_t age = num_kept - 1; age > 1; --age) {
    if (fs::exists(path(age - 1))) fs::rename(path(age - 1), path(age));
  }
  if (num_kept > 1 && fs::exists(path(0))) {
    // checkpoint.ckpt keeps its name until the next checkpoint replaces it.
    fs::remove(path(1));
    std::error_code no_links;
    fs::create_hard_link(path(0), path(1), no_links);
    if (no_links) fs::copy_file(path(0), path(1));
  }
  if (fs::exists(path(0))) fs::permissions(next, fs::status(path(0)).permissions());
  fs::rename(next, path(0));
}

std::string milestone_name(int64_t before, int64_t after, int64_t distance) {
  if (distance == 0 || after / distance == before / distance) return "";
  const int64_t steps = after / distance * distance;
  constexpr int64_t kThousand = 1000, kMillion = 1000000;
  if (steps % kMillion == 0) return fmt::format("milestone_{}M.ckpt", steps / kMillion);
  if (steps % kThousand == 0) return fmt::format("milestone_{}k.ckpt", steps / kThousand);
  return fmt::format("milestone_{}.ckpt", steps);
}

}  // namespace pictura
