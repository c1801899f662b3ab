// Realism score and further measures of simulated rollouts of recorded scenes. docs/explanation/realism.md has
// definitions and sources.
#pragma once

#include <array>
#include <functional>
#include <limits>
#include <memory>
#include <string>
#include <vector>

#include "pictura/common/support/json.h"
#include "pictura/evaluation/realism_features.h"
#include "pictura/evaluation/results.h"
#include "pictura/evaluation/scene_rollouts.h"
#include "pictura/map/scenario/scenario.h"

namespace pictura {

/// Scoring rule of a feature.
struct RealismTerm {
  double weight = 0;         // all weights sum to 1
  double low = 0, high = 0;  // values are clamped to this range
  int bins = 0;              // histogram bins; 0: the feature is an event
  double smoothing = 0;      // added to the count of every bin
};

/// Weights and bins of one year's Waymo Open Sim Agents Challenge.
struct RealismVersion {
  std::string name;
  std::array<RealismTerm, kNumRealismFeatures> terms;
};
const std::vector<RealismVersion>& realism_versions();
std::vector<std::string> realism_version_names();
/// Throws UsageError listing the names.
const RealismVersion& realism_version(const std::string& name);

using RealismLikelihoods = std::array<double, kNumRealismFeatures>;

/// Results of one scene; NaN: the scene has no data.
struct SceneRealism {
  std::string scenario_id;
  int rollouts = 0, scored = 0;  // scored: number of scored road users
  // Likelihoods in (0, 1]. pooled: exponential of the mean log-likelihood over all road users and steps. by_object:
  // mean over road users of the exponential of the road user's mean log-likelihood.
  RealismLikelihoods pooled, by_object;
  double score = 0, score_by_object = 0;  // weighted means of pooled and by_object
  double ade_m = 0, min_ade_m = 0;        // mean displacement; min_ade_m: of the best rollout
  // Shares of scored road users with the event.
  double collision_rate = 0, off_road_rate = 0, red_light_rate = 0;
  double recorded_collision_rate = 0, recorded_off_road_rate = 0, recorded_red_light_rate = 0;
  // short_time_to_collision: share of steps below kShortTimeToCollision_s. comfort: share of vehicles within all
  // comfort bounds. progress: mean completed share of the recorded path. All cover the scored vehicles.
  double short_time_to_collision = 0, recorded_short_time_to_collision = 0;
  double comfort = 0, recorded_comfort = 0;
  double progress = 0;
};
constexpr double kShortTimeToCollision_s = 0.95;

/// Recorded scene prepared for scoring.
class RealismScene {
 public:
  /// The scored road users are the self-driving car and the tracks to predict, or all road users if there are no tracks
  /// to predict. They must be present at kChallengeStart. Throws Error naming the scene if no step follows
  /// kChallengeStart, no road user is scored, or the time step is not 0.1 s.
  explicit RealismScene(std::shared_ptr<const Scenario> scenario);

  const Scenario& scenario() const { return *scenario_; }
  /// track_ids(): tracks present at kChallengeStart; every rollout must contain them.
  std::vector<int64_t> track_ids() const;
  std::vector<int64_t> scored_ids() const;

  const RealismFeatures& recorded_features() const { return recorded_features_; }
  /// Returns the features of one rollout. Throws Error naming a missing, unknown or duplicate track, or a state that is
  /// not finite or too far away.
  RealismFeatures features(const SceneRollouts& rollouts, size_t rollout) const;

  /// Throws Error as features() does, and if there are no rollouts.
  SceneRealism score(const SceneRollouts& rollouts, const RealismVersion& version) const;

 private:
  size_t num_poses() const { return kRealismHistory + static_cast<size_t>(kChallengeSteps); }
  /// Returns [objects][num_poses].
  std::vector<RealismPose> poses_of(const SceneRollouts& rollouts, size_t rollout) const;
  RealismFeatures features_of(const std::vector<RealismPose>& poses) const;
  double progress_of(size_t object, const RealismPose& end) const;

  std::shared_ptr<const Scenario> scenario_;
  RealismRoad road_;
  std::vector<int32_t> tracks_;  // [objects]
  std::vector<RealismObject> objects_;
  std::vector<size_t> scored_;  // indices of objects
  std::vector<RealismPose> recorded_;
  RealismFeatures recorded_features_;
};

/// Returns [steps]: log-likelihoods of recorded values under the histogram of the simulated values. A recorded NaN
/// gives NaN. Simulated NaNs are ignored; if all are NaN, the results are NaN.
std::vector<double> log_likelihoods(const RealismTerm& term, Span<const double> recorded, Span<const double> simulated);
/// Returns the log-likelihood of an event, or of its absence if the recording lacks it (`recorded` is false). `count`
/// of the rollouts have the event.
double event_log_likelihood(const RealismTerm& term, bool recorded, int count, int rollouts);

/// Scores of many scenes.
struct RealismReport {
  std::string version;
  std::vector<SceneRealism> scenes;
  std::vector<std::string> faults;  // scenes that cannot be read or scored, with reasons
  int without_rollouts = 0;         // scenes without rollouts in the file
  std::vector<std::string> unused;  // scenarios in the file that match no scene
};

/// Scores the rollouts in a file. scenes: names for find_scenes(). The calling thread calls on_progress(completed
/// fraction). Throws Error if the file cannot be read or no scene is scored.
RealismReport score_rollouts(const std::string& path, const std::vector<std::string>& scenes,
                             const RealismVersion& version, int num_threads,
                             const std::function<void(double)>& on_progress = {});

/// Return the mean over scenes whose value is not NaN.
Estimate mean_of(const RealismReport& report, double SceneRealism::* member);
Estimate mean_of(const RealismReport& report, RealismFeature feature);
/// Feature group (kinematic, interactive or map). Its likelihood in a scene is the weighted mean over its features.
struct RealismGroup {
  const char* name;
  std::vector<RealismFeature> features;
};
const std::vector<RealismGroup>& realism_groups();
Estimate mean_of(const RealismReport& report, const RealismGroup& group);

Json realism_json(const RealismReport& report);

}  // namespace pictura
