#include "pictura/evaluation/realism.h"

#include <algorithm>
#include <cmath>
#include <map>
#include <unordered_map>

#include <fmt/ranges.h>

#include "pictura/common/error.h"
#include "pictura/common/support/parallel_for.h"
#include "pictura/common/support/suggestion.h"
#include "pictura/evaluation/estimate_json.h"
#include "pictura/evaluation/scene_plan.h"
#include "pictura/map/scenario/load_scenario.h"

namespace pictura {

namespace {

constexpr double kNoValue = std::numeric_limits<double>::quiet_NaN();
constexpr double kRealismStep_s = 0.1;

constexpr double kFarthest_m = 1e6;  // maximum distance of a state from the scene

// nuPlan's bounds of comfort.
constexpr double kMinAcceleration_mps2 = -4.05, kMaxAcceleration_mps2 = 2.40, kMaxSideways_mps2 = 4.89;
constexpr double kMaxTurnRate = 0.95, kMaxTurnAcceleration = 1.93, kMaxJerk_mps3 = 4.13;

constexpr std::array kFeatures{RealismFeature::speed,
                               RealismFeature::acceleration,
                               RealismFeature::turn_rate,
                               RealismFeature::turn_acceleration,
                               RealismFeature::nearest_object,
                               RealismFeature::collision,
                               RealismFeature::time_to_collision,
                               RealismFeature::road_edge,
                               RealismFeature::off_road,
                               RealismFeature::red_light};

std::vector<RealismVersion> make_versions() {
  // Published configurations of the challenge. The smoothing of histograms is 0.1 per bin; that of events is 0.001, the
  // default value of the schema.
  constexpr double kOfHistogram = 0.1, kOfEvent = 0.001;
  RealismVersion of_2024{"2024", {}};
  const auto set = [](RealismFeature feature, RealismTerm term, RealismVersion* version) {
    version->terms[static_cast<size_t>(feature)] = term;
  };
  set(RealismFeature::speed, {0.05, 0, 25, 10, kOfHistogram}, &of_2024);
  set(RealismFeature::acceleration, {0.05, -12, 12, 11, kOfHistogram}, &of_2024);
  set(RealismFeature::turn_rate, {0.05, -0.628, 0.628, 11, kOfHistogram}, &of_2024);
  set(RealismFeature::turn_acceleration, {0.05, -3.14, 3.14, 11, kOfHistogram}, &of_2024);
  set(RealismFeature::nearest_object, {0.10, -5, 40, 10, kOfHistogram}, &of_2024);
  set(RealismFeature::collision, {0.25, 0, 1, 0, kOfEvent}, &of_2024);
  set(RealismFeature::time_to_collision, {0.10, 0, 5, 10, kOfHistogram}, &of_2024);
  set(RealismFeature::road_edge, {0.10, -20, 40, 10, kOfHistogram}, &of_2024);
  set(RealismFeature::off_road, {0.25, 0, 1, 0, kOfEvent}, &of_2024);
  set(RealismFeature::red_light, {0, 0, 1, 0, kOfEvent}, &of_2024);
  RealismVersion of_2025 = of_2024;
  of_2025.name = "2025";
  of_2025.terms[static_cast<size_t>(RealismFeature::road_edge)].weight = 0.05;
  of_2025.terms[static_cast<size_t>(RealismFeature::red_light)].weight = 0.05;
  return {of_2024, of_2025};
}

/// Accumulator of a mean; ignores NaN.
struct Mean {
  double sum = 0;
  int64_t count = 0;
  void add(double value) {
    if (std::isnan(value)) return;
    sum += value;
    ++count;
  }
  double value() const { return count > 0 ? sum / static_cast<double>(count) : kNoValue; }
};

double weighted_mean(const RealismVersion& version, const RealismLikelihoods& likelihoods,
                     Span<const RealismFeature> features) {
  double sum = 0, weights = 0;
  for (const RealismFeature feature : features) {
    const auto i = static_cast<size_t>(feature);
    if (std::isnan(likelihoods[i])) continue;
    sum += version.terms[i].weight * likelihoods[i];
    weights += version.terms[i].weight;
  }
  return weights > 0 ? sum / weights : kNoValue;
}

/// Returns 1 if the event happens at a step with a recorded value, else 0; NaN if no step has a recorded value.
double has_event(Span<const double> values, Span<const double> recorded) {
  double happens = kNoValue;
  for (size_t step = 0; step < values.size(); ++step) {
    if (std::isnan(recorded[step])) continue;
    happens = values[step] > 0 || happens > 0 ? 1 : 0;
  }
  return happens;
}

/// Returns means over the 0.7 s around each step. Recorded positions have centimetres of noise, which would dominate
/// the jerk of unsmoothed values.
std::vector<double> smoothed(Span<const double> values) {
  constexpr size_t kHalf = 3;
  std::vector<double> out(values.size(), kNoValue);
  for (size_t i = kHalf; i + kHalf < values.size(); ++i) {
    double sum = 0;
    for (size_t j = i - kHalf; j <= i + kHalf; ++j) sum += values[j];
    out[i] = sum / (2 * kHalf + 1);
  }
  return out;
}

/// Returns 1 if a vehicle's motion stays within all bounds of comfort, else 0; NaN if the vehicle is present for too
/// few steps.
double is_comfortable(const RealismFeatures& features, size_t object) {
  const std::vector<double> speeds = smoothed(features.of(object, RealismFeature::speed)),
                            turn_rates = smoothed(features.of(object, RealismFeature::turn_rate)),
                            accelerations = central_differences(speeds, kRealismStep_s),
                            turn_accelerations = central_differences(turn_rates, kRealismStep_s),
                            jerks = central_differences(accelerations, kRealismStep_s);
  double holds = kNoValue;
  for (size_t step = 0; step < features.num_steps(); ++step) {
    if (std::isnan(accelerations[step])) continue;
    // A NaN violates no bound, because comparisons with NaN are false.
    const bool breaks =
        accelerations[step] < kMinAcceleration_mps2 || accelerations[step] > kMaxAcceleration_mps2 ||
        std::abs(speeds[step] * turn_rates[step]) > kMaxSideways_mps2 || std::abs(turn_rates[step]) > kMaxTurnRate ||
        std::abs(turn_accelerations[step]) > kMaxTurnAcceleration || std::abs(jerks[step]) > kMaxJerk_mps3;
    if (breaks) return 0;
    holds = 1;
  }
  return holds;
}

void add_short_times(const RealismFeatures& features, size_t object, Mean* mean) {
  for (const double time_s : features.of(object, RealismFeature::time_to_collision)) {
    if (!std::isnan(time_s)) mean->add(time_s < kShortTimeToCollision_s);
  }
}

}  // namespace

const std::vector<RealismVersion>& realism_versions() {
  static const std::vector<RealismVersion> versions = make_versions();
  return versions;
}

std::vector<std::string> realism_version_names() {
  std::vector<std::string> names;
  for (const RealismVersion& version : realism_versions()) names.push_back(version.name);
  return names;
}

const RealismVersion& realism_version(const std::string& name) {
  for (const RealismVersion& version : realism_versions()) {
    if (version.name == name) return version;
  }
  fail_usage("realism: expected {}, got '{}'", fmt::join(realism_version_names(), " or "), name);
}

std::vector<double> log_likelihoods(const RealismTerm& term, Span<const double> recorded,
                                    Span<const double> simulated) {
  const auto bin_of = [&term](double value) {
    const double at = (std::clamp(value, term.low, term.high) - term.low) / (term.high - term.low) * term.bins;
    return std::min(static_cast<size_t>(at), static_cast<size_t>(term.bins) - 1);
  };
  std::vector<double> counts(static_cast<size_t>(term.bins), term.smoothing);
  int64_t samples = 0;
  for (const double value : simulated) {
    if (std::isnan(value)) continue;
    ++counts[bin_of(value)];
    ++samples;
  }
  const double all = static_cast<double>(samples) + term.smoothing * term.bins;
  std::vector<double> out(recorded.size(), kNoValue);
  for (size_t i = 0; i < recorded.size(); ++i) {
    if (samples > 0 && !std::isnan(recorded[i])) out[i] = std::log(counts[bin_of(recorded[i])] / all);
  }
  return out;
}

double event_log_likelihood(const RealismTerm& term, bool recorded, int count, int rollouts) {
  const int alike = recorded ? count : rollouts - count;
  return std::log((alike + term.smoothing) / (rollouts + 2 * term.smoothing));
}

RealismScene::RealismScene(std::shared_ptr<const Scenario> scenario)
    : scenario_(std::move(scenario)), road_(*scenario_) {
  const Scenario& scene = *scenario_;
  PICTURA_CHECK(scene.num_steps > kChallengeStart + 1, "scene {}: expected more than {} steps, got {}", scene.id,
                kChallengeStart + 1, scene.num_steps);
  check_time_step(scene);
  std::vector<uint8_t> is_scored(scene.tracks.size(), scene.tracks_to_predict.empty());
  for (const PredictedTrack& predicted : scene.tracks_to_predict) is_scored[static_cast<size_t>(predicted.track)] = 1;
  if (scene.sdc_track >= 0) is_scored[static_cast<size_t>(scene.sdc_track)] = 1;
  for (size_t i = 0; i < scene.tracks.size(); ++i) {
    const auto track = static_cast<int32_t>(i);
    if (!scene.valid_of(track)[kChallengeStart]) continue;
    if (is_scored[i]) scored_.push_back(tracks_.size());
    tracks_.push_back(track);
    const RecordedTrack& about = scene.tracks[i];
    objects_.push_back({about.type == TrackType::vehicle, static_cast<double>(about.length_m),
                        static_cast<double>(about.width_m), static_cast<double>(about.height_m)});
    for (size_t at = 0; at < num_poses(); ++at) {
      const int32_t step = kChallengeStart + 1 - static_cast<int32_t>(kRealismHistory) + static_cast<int32_t>(at);
      RealismPose& pose = recorded_.emplace_back();
      if (step >= scene.num_steps || !scene.valid_of(track)[step]) continue;
      const TrackState& state = scene.states_of(track)[step];
      pose = {static_cast<double>(state.position_m.x), static_cast<double>(state.position_m.y),
              static_cast<double>(state.position_m.z) + objects_.back().height_m / 2,
              static_cast<double>(state.heading_rad), true};
    }
  }
  PICTURA_CHECK(!scored_.empty(), "scene {}: expected a road user to score at step {}, got none", scene.id,
                kChallengeStart);
  recorded_features_ = features_of(recorded_);
}

std::vector<int64_t> RealismScene::track_ids() const {
  std::vector<int64_t> ids;
  for (const int32_t track : tracks_) ids.push_back(scenario_->tracks[static_cast<size_t>(track)].id);
  return ids;
}

std::vector<int64_t> RealismScene::scored_ids() const {
  const std::vector<int64_t> all = track_ids();
  std::vector<int64_t> ids;
  for (const size_t object : scored_) ids.push_back(all[object]);
  return ids;
}

RealismFeatures RealismScene::features_of(const std::vector<RealismPose>& poses) const {
  return realism_features(objects_, scored_, poses, road_, kChallengeStart + 1, kRealismStep_s);
}

std::vector<RealismPose> RealismScene::poses_of(const SceneRollouts& rollouts, size_t rollout) const {
  const std::string& id = scenario_->id;
  PICTURA_CHECK(rollouts.steps == kChallengeSteps, "scene {}: expected rollouts of {} steps, got {}", id,
                kChallengeSteps, rollouts.steps);
  const std::vector<int64_t> ids = track_ids();
  std::unordered_map<int64_t, size_t> objects;
  for (size_t i = 0; i < ids.size(); ++i) objects[ids[i]] = i;
  const std::vector<SimulatedState>& states = rollouts.rollouts.at(rollout);
  const std::array<double, 3>& origin_m = scenario_->map.origin_m;
  std::vector<RealismPose> poses = recorded_;
  std::vector<uint8_t> is_given(ids.size());
  for (size_t i = 0; i < rollouts.track_ids.size(); ++i) {
    const int64_t track = rollouts.track_ids[i];
    const auto found = objects.find(track);
    PICTURA_CHECK(found != objects.end(), "scene {}: rollout {}: track {} is absent at step {} of the recording", id,
                  rollout, track, kChallengeStart);
    PICTURA_CHECK(!is_given[found->second], "scene {}: rollout {}: track {} occurs twice", id, rollout, track);
    is_given[found->second] = 1;
    for (size_t step = 0; step < kChallengeSteps; ++step) {
      const SimulatedState& state = states[i * kChallengeSteps + step];
      const RealismPose pose{static_cast<double>(state.x_m) - origin_m[0], static_cast<double>(state.y_m) - origin_m[1],
                             static_cast<double>(state.z_m) - origin_m[2], static_cast<double>(state.heading_rad),
                             true};
      // A NaN makes both comparisons false.
      const bool is_near = std::abs(pose.x_m) + std::abs(pose.y_m) + std::abs(pose.z_m) <= kFarthest_m &&
                           std::abs(pose.heading_rad) <= kFarthest_m;
      PICTURA_CHECK(is_near,
                    "scene {}: rollout {}: track {}: expected finite numbers, within {:g} m of the scene, got {}, {}, "
                    "{}, {} at step {}",
                    id, rollout, track, kFarthest_m, state.x_m, state.y_m, state.z_m, state.heading_rad, step);
      poses[found->second * num_poses() + kRealismHistory + step] = pose;
    }
  }
  const auto missing = std::find(is_given.begin(), is_given.end(), 0);
  PICTURA_CHECK(missing == is_given.end(),
                "scene {}: rollout {}: expected all {} tracks of step {}, track {} is missing", id, rollout, ids.size(),
                kChallengeStart, ids[static_cast<size_t>(missing - is_given.begin())]);
  return poses;
}

RealismFeatures RealismScene::features(const SceneRollouts& rollouts, size_t rollout) const {
  return features_of(poses_of(rollouts, rollout));
}

/// Returns the share of an object's recorded path up to the point of the path that is nearest to `end`; NaN if the path
/// is shorter than kMovingTrack_m.
double RealismScene::progress_of(size_t object, const RealismPose& end) const {
  double passed_m = 0, length_m = 0, nearest_m2 = std::numeric_limits<double>::infinity();
  const RealismPose* last = nullptr;
  for (size_t at = kRealismHistory - 1; at < num_poses(); ++at) {
    const RealismPose& pose = recorded_[object * num_poses() + at];
    if (!pose.is_valid) continue;
    if (last) {
      const double x = pose.x_m - last->x_m, y = pose.y_m - last->y_m, squared = x * x + y * y;
      const double t =
          std::clamp(((end.x_m - last->x_m) * x + (end.y_m - last->y_m) * y) / std::max(squared, 1e-12), 0.0, 1.0);
      const double away_x = end.x_m - last->x_m - t * x, away_y = end.y_m - last->y_m - t * y;
      const double step_m = std::sqrt(squared), distance_m2 = away_x * away_x + away_y * away_y;
      if (distance_m2 < nearest_m2) {
        nearest_m2 = distance_m2;
        passed_m = length_m + t * step_m;
      }
      length_m += step_m;
    }
    last = &pose;
  }
  return length_m >= static_cast<double>(kMovingTrack_m) ? passed_m / length_m : kNoValue;
}

SceneRealism RealismScene::score(const SceneRollouts& rollouts, const RealismVersion& version) const {
  SceneRealism result;
  result.scenario_id = scenario_->id;
  result.rollouts = static_cast<int>(rollouts.rollouts.size());
  result.scored = static_cast<int>(scored_.size());
  PICTURA_CHECK(result.rollouts > 0, "scene {}: expected a rollout or more, got none", scenario_->id);

  std::vector<RealismFeatures> simulated;
  Mean ade, short_times, recorded_short_times, comfort, recorded_comfort, progress;
  double min_ade_m = std::numeric_limits<double>::infinity();
  for (size_t rollout = 0; rollout < rollouts.rollouts.size(); ++rollout) {
    const std::vector<RealismPose> poses = poses_of(rollouts, rollout);
    simulated.push_back(features_of(poses));
    Mean displacement_m;  // mean over road users
    for (size_t i = 0; i < scored_.size(); ++i) {
      Mean over_steps;
      for (size_t at = scored_[i] * num_poses() + kRealismHistory; at < (scored_[i] + 1) * num_poses(); ++at) {
        const RealismPose &pose = poses[at], &recorded = recorded_[at];
        if (!recorded.is_valid) continue;
        over_steps.add(std::hypot(pose.x_m - recorded.x_m, pose.y_m - recorded.y_m, pose.z_m - recorded.z_m));
      }
      displacement_m.add(over_steps.value());
      if (!objects_[scored_[i]].is_vehicle) continue;
      comfort.add(is_comfortable(simulated.back(), i));
      add_short_times(simulated.back(), i, &short_times);
      progress.add(progress_of(scored_[i], poses[(scored_[i] + 1) * num_poses() - 1]));
    }
    ade.add(displacement_m.value());
    if (displacement_m.count > 0) min_ade_m = std::min(min_ade_m, displacement_m.value());
  }
  for (size_t i = 0; i < scored_.size(); ++i) {
    if (!objects_[scored_[i]].is_vehicle) continue;
    recorded_comfort.add(is_comfortable(recorded_features_, i));
    add_short_times(recorded_features_, i, &recorded_short_times);
  }
  result.ade_m = ade.value();
  result.min_ade_m = ade.count > 0 ? min_ade_m : kNoValue;
  result.comfort = comfort.value();
  result.recorded_comfort = recorded_comfort.value();
  result.short_time_to_collision = short_times.value();
  result.recorded_short_time_to_collision = recorded_short_times.value();
  result.progress = progress.value();

  const std::map<RealismFeature, std::pair<double SceneRealism::*, double SceneRealism::*>> rates{
      {RealismFeature::collision, {&SceneRealism::collision_rate, &SceneRealism::recorded_collision_rate}},
      {RealismFeature::off_road, {&SceneRealism::off_road_rate, &SceneRealism::recorded_off_road_rate}},
      {RealismFeature::red_light, {&SceneRealism::red_light_rate, &SceneRealism::recorded_red_light_rate}}};
  for (const RealismFeature feature : kFeatures) {
    const auto f = static_cast<size_t>(feature);
    const RealismTerm& term = version.terms[f];
    Mean pooled, by_object, events, recorded_events;
    std::vector<double> values;
    for (size_t i = 0; i < scored_.size(); ++i) {
      const Span<const double> recorded = recorded_features_.of(i, feature);
      Mean over_steps;
      if (term.bins > 0) {
        values.clear();
        for (const RealismFeatures& one : simulated) {
          const Span<const double> its = one.of(i, feature);
          values.insert(values.end(), its.begin(), its.end());
        }
        for (const double value : log_likelihoods(term, recorded, values)) over_steps.add(value);
      } else {
        const double happened = has_event(recorded, recorded);
        if (std::isnan(happened)) continue;
        int count = 0;
        for (const RealismFeatures& one : simulated) count += has_event(one.of(i, feature), recorded) > 0;
        over_steps.add(event_log_likelihood(term, happened > 0, count, result.rollouts));
        events.add(static_cast<double>(count) / result.rollouts);
        recorded_events.add(happened);
      }
      pooled.sum += over_steps.sum;
      pooled.count += over_steps.count;
      by_object.add(std::exp(over_steps.value()));
    }
    result.pooled[f] = std::exp(pooled.value());
    result.by_object[f] = by_object.value();
    if (const auto rate = rates.find(feature); rate != rates.end()) {
      result.*rate->second.first = events.value();
      result.*rate->second.second = recorded_events.value();
    }
  }
  result.score = weighted_mean(version, result.pooled, kFeatures);
  result.score_by_object = weighted_mean(version, result.by_object, kFeatures);
  return result;
}

RealismReport score_rollouts(const std::string& path, const std::vector<std::string>& scenes,
                             const RealismVersion& version, int num_threads,
                             const std::function<void(double)>& on_progress) {
  if (scenes.empty()) fail_usage("realism: expected scenes, got none");
  const RolloutsReader file(path);
  RealismReport report;
  report.version = version.name;
  std::vector<SceneRef> all;
  for (const std::string& name : scenes) {
    SceneIndex index = find_scenes(name);
    std::move(index.scenes.begin(), index.scenes.end(), std::back_inserter(all));
    std::move(index.faults.begin(), index.faults.end(), std::back_inserter(report.faults));
  }

  struct Outcome {
    std::string id, fault;
    bool has_rollouts = false;
    SceneRealism realism;
  };
  std::map<std::string, int> uses;
  // Scenes are scored in groups; progress is reported after each group.
  const auto turn = static_cast<size_t>(4 * resolve_num_threads(num_threads));
  for (size_t first = 0; first < all.size(); first += turn) {
    std::vector<Outcome> outcomes(std::min(turn, all.size() - first));
    parallel_for(num_threads, static_cast<int64_t>(outcomes.size()), [&](int64_t item) {
      const SceneRef& scene = all[first + static_cast<size_t>(item)];
      Outcome& outcome = outcomes[static_cast<size_t>(item)];
      // If the index knows the scene's id, a scene without rollouts need not be read.
      if (!scene.id.empty() && !file.has(scene.id)) return;
      outcome.id = scene.id;
      try {
        auto scenario = std::make_shared<const Scenario>(load_scenario(scene));
        outcome.id = scenario->id;
        outcome.has_rollouts = file.has(outcome.id);
        if (outcome.has_rollouts) {
          outcome.realism = RealismScene(std::move(scenario)).score(file.read(outcome.id), version);
        }
      } catch (const Error& error) {
        outcome.has_rollouts = true;
        outcome.fault = error.what();
      }
    });
    for (Outcome& outcome : outcomes) {
      if (!outcome.has_rollouts) {
        ++report.without_rollouts;
      } else if (!outcome.fault.empty()) {
        report.faults.push_back(std::move(outcome.fault));
        ++uses[outcome.id];
      } else {
        PICTURA_CHECK(++uses[outcome.id] == 1, "scenario '{}' occurs twice in {}", outcome.id, fmt::join(scenes, ", "));
        report.scenes.push_back(std::move(outcome.realism));
      }
    }
    if (on_progress)
      on_progress(static_cast<double>(std::min(first + turn, all.size())) / static_cast<double>(all.size()));
  }
  for (const std::string& id : file.scenario_ids()) {
    if (!uses.contains(id)) report.unused.push_back(id);
  }
  PICTURA_CHECK(!report.scenes.empty(), "{}: expected rollouts of a scene of {}: of {} scenes, {} are not in it{}{}",
                path, fmt::join(scenes, ", "), all.size(), report.without_rollouts, report.faults.empty() ? "" : "; ",
                report.faults.empty() ? "" : report.faults.front());
  return report;
}

namespace {

template <typename Value>
Estimate mean_over(const std::vector<SceneRealism>& scenes, const Value& value_of) {
  std::vector<RatioTerm> terms;
  for (const SceneRealism& scene : scenes) {
    const double value = value_of(scene);
    if (!std::isnan(value)) terms.push_back({value, 1});
  }
  return estimate_ratio(terms);
}

// X(name in reports, member)
#define PICTURA_REALISM_FIGURES(X)                                              \
  X("realism", score)                                                           \
  X("realism_by_object", score_by_object)                                       \
  X("ade_m", ade_m)                                                             \
  X("min_ade_m", min_ade_m)                                                     \
  X("collision_rate", collision_rate)                                           \
  X("recorded_collision_rate", recorded_collision_rate)                         \
  X("off_road_rate", off_road_rate)                                             \
  X("recorded_off_road_rate", recorded_off_road_rate)                           \
  X("red_light_rate", red_light_rate)                                           \
  X("recorded_red_light_rate", recorded_red_light_rate)                         \
  X("short_time_to_collision_share", short_time_to_collision)                   \
  X("recorded_short_time_to_collision_share", recorded_short_time_to_collision) \
  X("comfortable_share", comfort)                                               \
  X("recorded_comfortable_share", recorded_comfort)                             \
  X("progress", progress)

}  // namespace

Estimate mean_of(const RealismReport& report, double SceneRealism::* member) {
  return mean_over(report.scenes, [member](const SceneRealism& scene) { return scene.*member; });
}

Estimate mean_of(const RealismReport& report, RealismFeature feature) {
  return mean_over(report.scenes,
                   [feature](const SceneRealism& scene) { return scene.pooled[static_cast<size_t>(feature)]; });
}

const std::vector<RealismGroup>& realism_groups() {
  static const std::vector<RealismGroup> groups{
      {"kinematic",
       {RealismFeature::speed, RealismFeature::acceleration, RealismFeature::turn_rate,
        RealismFeature::turn_acceleration}},
      {"interactive", {RealismFeature::nearest_object, RealismFeature::collision, RealismFeature::time_to_collision}},
      {"map", {RealismFeature::road_edge, RealismFeature::off_road, RealismFeature::red_light}}};
  return groups;
}

Estimate mean_of(const RealismReport& report, const RealismGroup& group) {
  const RealismVersion& version = realism_version(report.version);
  return mean_over(report.scenes,
                   [&](const SceneRealism& scene) { return weighted_mean(version, scene.pooled, group.features); });
}

Json realism_json(const RealismReport& report) {
  const RealismVersion& version = realism_version(report.version);
  Json json{{"version", report.version}, {"scored", report.scenes.size()}};
#define X(name, member) add_estimate(name, mean_of(report, &SceneRealism::member), &json);
  PICTURA_REALISM_FIGURES(X)
#undef X
  for (const RealismGroup& group : realism_groups()) add_estimate(group.name, mean_of(report, group), &json["groups"]);
  for (const RealismFeature feature : kFeatures) {
    Json& one = json["likelihoods"].emplace_back(
        Json{{"feature", to_string(feature)}, {"weight", version.terms[static_cast<size_t>(feature)].weight}});
    add_estimate("likelihood", mean_of(report, feature), &one);
  }
  json["scenes"] = Json::array();
  for (const SceneRealism& scene : report.scenes) {
    Json& one = json["scenes"].emplace_back(
        Json{{"scenario_id", scene.scenario_id}, {"rollouts", scene.rollouts}, {"road_users", scene.scored}});
#define X(name, member) one[name] = finite_or_null(scene.member);
    PICTURA_REALISM_FIGURES(X)
#undef X
    for (const RealismFeature feature : kFeatures) {
      const auto f = static_cast<size_t>(feature);
      one["likelihoods"][to_string(feature)] = finite_or_null(scene.pooled[f]);
      one["likelihoods_by_object"][to_string(feature)] = finite_or_null(scene.by_object[f]);
    }
  }
  json["without_rollouts"] = report.without_rollouts;
  json["unused"] = report.unused;
  json["faults"] = report.faults;
  return json;
}

}  // namespace pictura
