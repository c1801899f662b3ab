// Visits the paths of files and folders in a configuration.
#pragma once

#include <optional>
#include <string>

#include "pictura/configuration/config.h"
#include "pictura/map/load_map.h"

namespace pictura {

/// Calls visit(key, &path) for every path in the configuration. visit() may change the path.
template <typename Visit>
void visit_paths(Config* config, Visit&& visit) {
  if (!config->render.rig.empty()) visit("render.rig", &config->render.rig);
  if (config->policy.backbone != "conv") visit("policy.backbone", &config->policy.backbone);
  if (!config->train.teacher.empty()) visit("train.teacher", &config->train.teacher);
  for (std::string& text : config->simulator.other_policies) {
    std::string file = parse_share(text)->name;
    const std::string share = text.substr(file.size());
    visit("simulator.others.policies", &file);
    text = file + share;
  }
  for (std::string& map : config->simulator.maps) {
    if (std::optional<std::string> scenes = scene_source(map)) {
      visit("simulator.maps", &*scenes);
      map = map_of_scenes(*scenes);
    } else if (is_map_file(map)) {
      visit("simulator.maps", &map);
    }
  }
}

}  // namespace pictura
