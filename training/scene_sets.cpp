#include "pictura/training/scene_sets.h"

#include <algorithm>
#include <limits>

#include <fmt/ranges.h>

#include "pictura/backends/make_simulator.h"
#include "pictura/common/error.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/evaluation/scene_plan.h"
#include "pictura/simulator/hash_values.h"
#include "pictura/simulator/recorded_scene.h"

namespace pictura {

namespace {

/// Returns the first recorded position of a track. The track must have one.
Vec2 first_place(const CompiledMap& map, int32_t track) {
  const MapRecord& record = map.rules.record;
  const auto agent = static_cast<size_t>(track);
  return record.state(agent, record.first_step(agent)).position_m.xy();
}

/// Sorts tracks by the distance from their first recorded place to the nearest first place of a driven track.
void sort_by_distance(const CompiledMap& map, Span<const int32_t> driven, std::vector<int32_t>* tracks_inout) {
  std::vector<std::pair<float, int32_t>> ranked;
  for (const int32_t track : *tracks_inout) {
    float nearest_m = std::numeric_limits<float>::max();
    for (const int32_t other : driven) {
      nearest_m = std::min(nearest_m, length(first_place(map, track) - first_place(map, other)));
    }
    ranked.emplace_back(nearest_m, track);
  }
  std::sort(ranked.begin(), ranked.end());
  std::transform(ranked.begin(), ranked.end(), tracks_inout->begin(), [](const auto& pair) { return pair.second; });
}

std::vector<SceneRef> scenes_of(const std::vector<std::string>& maps, std::vector<std::string>* faults_out) {
  std::vector<SceneRef> scenes;
  for (const std::string& map : maps) {
    SceneIndex index = find_scenes(*scene_source(map));
    std::move(index.scenes.begin(), index.scenes.end(), std::back_inserter(scenes));
    std::move(index.faults.begin(), index.faults.end(), std::back_inserter(*faults_out));
  }
  PICTURA_CHECK(!scenes.empty(), "{}: expected recorded scenes, got none", fmt::join(maps, ", "));
  return scenes;
}

}  // namespace

std::shared_ptr<const CompiledMap> compile_training_scene(const SceneRef& scene, const SceneProtocol& protocol,
                                                          SimulatorConfig config, int num_agents) {
  MapOptions options = map_options(config);
  options.observed_span_m = protocol.observed_span_m;
  const std::shared_ptr<const CompiledMap> map =
      compile_scenario(protocol_scene(load_scenario(scene), protocol), options, protocol.start_step);
  if (!has_drivers(*map, protocol)) return nullptr;
  const auto max_replayed = static_cast<size_t>(config.parked_cars);
  config.parked_cars = 0;
  config.device = {};
  config.num_threads = 1;
  config.vector_observations = false;
  const std::unique_ptr<Simulator> at_start = make_simulator("cpu", config, CompiledMaps{map}, {scene_world(*map)});
  SceneProtocol fitting = protocol;
  fitting.max_driven = protocol.max_driven > 0 ? std::min(protocol.max_driven, num_agents) : num_agents;
  const ScenePlan plan = plan_scene(*map, at_start->scene().agents, fitting, /*density=*/1, config.seed);
  std::vector<int32_t> driven, replayed;
  for (int32_t track = 0; track < static_cast<int32_t>(plan.roles.size()); ++track) {
    const SceneRole role = plan.roles[static_cast<size_t>(track)];
    if (role == SceneRole::removed) continue;
    (role == SceneRole::driven ? driven : replayed).push_back(track);
  }
  if (driven.empty()) return nullptr;
  if (replayed.size() > max_replayed) {
    sort_by_distance(*map, driven, &replayed);
    replayed.resize(max_replayed);
  }
  return with_tracks(*map, driven, replayed, num_agents);
}

SceneSets::SceneSets(const Config& config, const SimulatorConfig& world, std::vector<WorldSpec> worlds,
                     int num_all_worlds)
    : protocol_(config.simulator.scenes.training_protocol()),
      world_(world),
      worlds_(std::move(worlds)),
      seed_(config.run.seed),
      num_all_worlds_(num_all_worlds),
      updates_per_set_(config.simulator.scenes.updates_per_set),
      num_agents_(config.simulator.max_agents),
      num_threads_(config.run.num_threads),
      scenes_(scenes_of(config.simulator.maps, &notices_)) {}

SceneSets::~SceneSets() {
  if (next_.valid()) next_.wait();
}

SceneSet SceneSets::take(int64_t number) {
  if (next_.valid() && next_number_ != number) next_.wait();
  const bool is_prepared = next_.valid() && next_number_ == number;
  SceneSet set = is_prepared ? next_.get() : make(number);
  std::move(new_notices_.begin(), new_notices_.end(), std::back_inserter(notices_));
  new_notices_.clear();
  next_number_ = number + 1;
  next_ = std::async(std::launch::async, [this] { return make(next_number_); });
  return set;
}

std::vector<std::string> SceneSets::take_notices() { return std::exchange(notices_, {}); }

std::shared_ptr<const CompiledMap> SceneSets::compile(size_t scene, std::string* fault_out) const {
  try {
    return compile_training_scene(scenes_[scene], protocol_, world_, num_agents_);
  } catch (const Error& error) {
    *fault_out = fmt::format("left out: {}", error.what());
  }
  return nullptr;
}

SceneSet SceneSets::make(int64_t number) {
  // Scene of each world. A scene that cannot be used is replaced by the next scene.
  std::vector<size_t> wanted;
  for (const WorldSpec& world : worlds_) {
    wanted.push_back(static_cast<size_t>(number * num_all_worlds_ + world.global_world) % scenes_.size());
  }
  const Maps before = std::exchange(maps_, {});
  int num_undriven = 0;
  for (bool is_complete = false; !is_complete;) {
    is_complete = true;
    std::vector<size_t> missing;
    for (size_t& scene : wanted) {
      while (unusable_.size() < scenes_.size() && unusable_.contains(scene)) scene = (scene + 1) % scenes_.size();
      if (maps_.contains(scene)) continue;
      if (const auto old = before.find(scene); old != before.end()) {
        maps_.insert(*old);
      } else if (std::find(missing.begin(), missing.end(), scene) == missing.end()) {
        missing.push_back(scene);
      }
    }
    PICTURA_CHECK(unusable_.size() < scenes_.size(),
                  "simulator.maps: expected a scene with road users to drive, got {}{}", scenes_.size(),
                  new_notices_.empty() ? " without any" : "; " + new_notices_.front());
    Maps compiled;
    for (const size_t scene : missing) compiled[scene] = nullptr;
    std::vector<std::string> faults(missing.size());
    parallel_for(num_threads_, static_cast<int64_t>(missing.size()), [&](int64_t item) {
      const auto i = static_cast<size_t>(item);
      compiled.at(missing[i]) = compile(missing[i], &faults[i]);
    });
    for (size_t i = 0; i < missing.size(); ++i) {
      if (compiled.at(missing[i])) {
        maps_.insert(*compiled.find(missing[i]));
        continue;
      }
      is_complete = false;
      unusable_.insert(missing[i]);
      num_undriven += faults[i].empty();
      if (!faults[i].empty()) new_notices_.push_back(std::move(faults[i]));
    }
  }
  if (num_undriven > 0) {
    new_notices_.push_back(fmt::format("left out: {} scenes without road users to drive", num_undriven));
  }
  SceneSet set;
  std::map<size_t, int> index_of_scene;
  for (size_t i = 0; i < worlds_.size(); ++i) {
    const auto [index, is_new] = index_of_scene.try_emplace(wanted[i], static_cast<int>(set.maps.size()));
    if (is_new) set.maps.push_back(maps_.at(wanted[i]));
    set.worlds.push_back(worlds_[i]);
    set.worlds.back().map = index->second;
  }
  // Each set needs another seed, because each set begins with episode 0.
  Hash64 hash;
  add_values(&hash, seed_, number);
  set.seed = number == 0 ? seed_ : hash.value();
  return set;
}

}  // namespace pictura
