#include "pictura/training/checkpoint.h"

#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/policy/checkpoint_file.h"
#include "pictura/policy/policy_json.h"

namespace pictura {

using nlohmann::ordered_json;

void write_checkpoint(const std::string& path, const Checkpoint& checkpoint) {
  CheckpointWriter writer;
  writer.add_policy(checkpoint);
  writer.header["counters"].update({{"distance_m", checkpoint.distance_m},
                                    {"adam_steps", checkpoint.adam_steps},
                                    {"filter_average", checkpoint.filter_average}});
  writer.header["recent"] = ordered_json::array();
  for (const RecentUpdate& r : checkpoint.recent) {
    writer.header["recent"].push_back({{"finished", r.finished}, {"finished_return", r.finished_return}});
  }
  writer.header["longest_update_s"] = checkpoint.longest_update_s;
  writer.add_weights({checkpoint, to_stored(checkpoint.parameters)});
  writer.add_tensors("first_moments", to_stored(checkpoint.first_moments));
  writer.add_tensors("second_moments", to_stored(checkpoint.second_moments));
  if (!checkpoint.average.empty()) {
    writer.add_tensors("average", to_stored(checkpoint.average));
    writer.header["counters"]["averaged_updates"] = checkpoint.averaged_updates;
  }
  writer.add_bytes("simulator",
                   {reinterpret_cast<const char*>(checkpoint.simulator.data()), checkpoint.simulator.size()});
  write_file(path, writer.finish());
}

Checkpoint read_checkpoint(const std::string& path) { return parse_checkpoint(read_policy_file(path), path); }

Checkpoint parse_checkpoint(const std::string& bytes, const std::string& path) {
  const CheckpointFile file(bytes, path);
  return read_header(path, [&] {
    const ordered_json &header = file.header, &counters = header.at("counters");
    const StoredPolicy policy = file.policy();
    Checkpoint result{{policy, to_tensors(policy.parameters)}};
    result.first_moments = to_tensors(file.tensors("first_moments"));
    result.second_moments = to_tensors(file.tensors("second_moments"));
    if (header.contains("average")) {
      result.average = to_tensors(file.tensors("average"));
      result.averaged_updates = counters.at("averaged_updates");
    }
    const std::string_view simulator = file.bytes("simulator");
    result.simulator.assign(simulator.begin(), simulator.end());
    result.distance_m = counters.at("distance_m");
    result.adam_steps = counters.at("adam_steps");
    result.filter_average = counters.at("filter_average");
    // A checkpoint without this entry also resumes exactly; only the averages restart.
    for (const ordered_json& json : header.value("recent", ordered_json::array())) {
      result.recent.push_back({json.at("finished"), json.at("finished_return")});
    }
    result.longest_update_s = header.value("longest_update_s", result.longest_update_s);
    return result;
  });
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
