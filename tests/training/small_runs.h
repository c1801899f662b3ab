// Training runs of a few vehicles on the procedural town.
#pragma once

#include <array>
#include <sstream>
#include <string>
#include <vector>

#include "pictura/common/support/file.h"
#include "pictura/evaluation/evaluate.h"
#include "pictura/training/loop.h"

namespace pictura::test {

/// Options of four updates of a reduced configs/smoke.toml. device: value of run.device.
inline TrainOptions small_run(const std::string& out_folder, const std::string& device,
                              const std::vector<std::string>& more = {}) {
  TrainOptions o;
  o.config_path = PICTURA_SOURCE_DIR "/configs/smoke.toml";
  o.out_folder = out_folder;
  o.overrides = {"run.device=" + device,
                 "run.num_threads=1",
                 device == "cpu" ? "render.backend=cpu" : "render.backend=auto",
                 "render.width_px=16",
                 "render.height_px=9",
                 "simulator.num_slots=8",
                 "train.num_steps=12",
                 "policy.patch_px=1",
                 "policy.conv_channels=[4, 8]",
                 "policy.conv_kernels=[3, 3]",
                 "policy.conv_strides=[2, 2]"};
  o.overrides.insert(o.overrides.end(), more.begin(), more.end());
  return o;
}

/// Makes a run of two updates, its repetition, and a run resumed after the first update. Returns their policies'
/// hashes.
inline std::array<std::string, 3> policies_of_equal_runs(const std::string& folder, const std::string& device,
                                                         std::vector<std::string> more) {
  more.push_back("train.updates=2");
  const std::string whole = train(small_run(folder + "/whole", device, more)).policy_hash,
                    again = train(small_run(folder + "/again", device, more)).policy_hash;
  TrainOptions parts = small_run(folder + "/parts", device, more);
  parts.overrides.back() = "train.updates=1";
  train(parts);
  parts.overrides.back() = "train.updates=2";
  parts.old_run = OldRun::resume;
  return {whole, again, train(parts).policy_hash};
}

inline EvaluateOptions one_scenario(const std::string& checkpoint, int steps) {
  EvaluateOptions o;
  o.device = "cpu";
  o.checkpoint = checkpoint;
  o.maps = {"procedural"};
  o.scenarios = 1;
  o.steps = steps;
  o.num_threads = 1;
  return o;
}

/// Returns the cells of a progress.csv, header first.
inline std::vector<std::vector<std::string>> read_table(const std::string& path) {
  std::vector<std::vector<std::string>> rows;
  std::istringstream lines(read_file(path));
  for (std::string line; std::getline(lines, line);) {
    std::istringstream cells(line);
    rows.emplace_back();
    for (std::string cell; std::getline(cells, cell, ',');) rows.back().push_back(cell);
  }
  return rows;
}

}  // namespace pictura::test
