// Measures of simulated rollouts of recorded scenes: realism score, displacement, events, time to collision, comfort
// and progress. The realism score is the likelihood of the recorded motion under the distribution of the rollouts.
// docs/explanation/realism.md has the definitions and their sources. Includes no torch headers.
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

/// Scoring rule of one feature.
struct RealismTerm {
  double weight = 0;         // the weights of all terms sum to 1
  double low = 0, high = 0;  // values are clamped to this range
  int bins = 0;              // histogram bins; 0: the feature is an event, which a rollout contains or lacks
  double smoothing = 0;      // added to the count of every bin
};

/// Weights and bins of one year's Waymo Open Sim Agents Challenge.
struct RealismVersion {
  std::string name;
  std::array<RealismTerm, kNumRealismFeatures> terms;  // indexed by RealismFeature
};
const std::vector<RealismVersion>& realism_versions();
std::vector<std::string> realism_version_names();
/// Returns the version of this name. Throws UsageError listing the names.
const RealismVersion& realism_version(const std::string& name);

/// Last recorded step before the rollouts, and number of steps of each rollout.
constexpr int32_t kRealismStart = 10, kRealismSteps = 80;

using RealismLikelihoods = std::array<double, kNumRealismFeatures>;

/// Results of the rollouts of one scene. A value is NaN if the scene has no data for it.
struct SceneRealism {
  std::string scenario_id;
  int rollouts = 0, scored = 0;  // scored: number of scored road users
  // Likelihoods in (0, 1]. pooled: the exponential of the mean log-likelihood over all road users and steps. by_object:
  // for each road user, the exponential of its mean log-likelihood over its steps; then the mean over road users.
  RealismLikelihoods pooled, by_object;
  double score = 0, score_by_object = 0;  // weighted means of pooled and by_object over features without NaN
  double ade_m = 0, min_ade_m = 0;        // mean displacement of all road users: mean and minimum over rollouts
  // Shares of scored road users that have the event in rollouts, and in the recording.
  double collision_rate = 0, off_road_rate = 0, red_light_rate = 0;
  double recorded_collision_rate = 0, recorded_off_road_rate = 0, recorded_red_light_rate = 0;
  // short_time_to_collision: share of steps with a time to collision below kShortTimeToCollision_s. comfort: share of
  // vehicles within all bounds of comfort. Both cover the scored vehicles of all rollouts, or of the recording.
  // progress: share of the recorded path before the point nearest to the vehicle's final position; mean over vehicles.
  double short_time_to_collision = 0, recorded_short_time_to_collision = 0;
  double comfort = 0, recorded_comfort = 0;
  double progress = 0;
};
constexpr double kShortTimeToCollision_s = 0.95;

/// A recorded scene, prepared for scoring.
class RealismScene {
 public:
  /// Throws Error naming the scene if it has no step after kRealismStart or no road user to score, or if its time step
  /// is not 0.1 s. The scored road users are the self-driving car and the tracks to predict, if they are present at
  /// kRealismStart. If the scene lists no tracks to predict, all present road users are scored.
  explicit RealismScene(std::shared_ptr<const Scenario> scenario);

  const Scenario& scenario() const { return *scenario_; }
  /// track_ids() returns the ids of the tracks that are present at kRealismStart; every rollout must contain all these
  /// tracks. scored_ids() returns the ids of the tracks that are scored.
  std::vector<int64_t> track_ids() const;
  std::vector<int64_t> scored_ids() const;

  const RealismFeatures& recorded_features() const { return recorded_features_; }
  /// Returns the features of one rollout. Throws Error naming a track that is missing, unknown or duplicate, or a state
  /// that is not finite or is too far from the scene.
  RealismFeatures features(const SceneRollouts& rollouts, size_t rollout) const;

  /// Returns the results of all rollouts. Throws Error as features() does, and if there are no rollouts.
  SceneRealism score(const SceneRollouts& rollouts, const RealismVersion& version) const;

 private:
  size_t num_poses() const { return kRealismHistory + static_cast<size_t>(kRealismSteps); }
  /// Returns the poses of one rollout, [objects][num_poses].
  std::vector<RealismPose> poses_of(const SceneRollouts& rollouts, size_t rollout) const;
  RealismFeatures features_of(const std::vector<RealismPose>& poses) const;
  double progress_of(size_t object, const RealismPose& end) const;

  std::shared_ptr<const Scenario> scenario_;
  RealismRoad road_;
  std::vector<int32_t> tracks_;  // [objects] index of the object's track
  std::vector<RealismObject> objects_;
  std::vector<size_t> scored_;  // indices of objects
  std::vector<RealismPose> recorded_;
  RealismFeatures recorded_features_;
};

/// Returns the log-likelihoods [steps] of one road user's recorded values under the histogram of the simulated values;
/// NaN at steps whose recorded value is NaN. Simulated NaNs are ignored. If all simulated values are NaN, all results
/// are NaN.
std::vector<double> log_likelihoods(const RealismTerm& term, Span<const double> recorded, Span<const double> simulated);
/// Returns the log-likelihood that a recording contains an event (if `recorded`) or lacks it (otherwise), given that
/// `count` of `rollouts` rollouts contain it.
double event_log_likelihood(const RealismTerm& term, bool recorded, int count, int rollouts);

/// Scores of many scenes.
struct RealismReport {
  std::string version;
  std::vector<SceneRealism> scenes;
  std::vector<std::string> faults;  // scenes that cannot be read or scored, with reasons
  int without_rollouts = 0;         // number of scenes without rollouts in the file
  std::vector<std::string> unused;  // ids of scenarios in the file that match no scene
};

/// Scores the rollouts in the file `path`. `scenes`: names of the recorded scenes for find_scenes(). Throws Error if
/// the file cannot be read or no scene is scored. on_progress(completed fraction) is called by the calling thread.
RealismReport score_rollouts(const std::string& path, const std::vector<std::string>& scenes,
                             const RealismVersion& version, int num_threads,
                             const std::function<void(double)>& on_progress = {});

/// Returns the mean over the scenes in which the member or the feature is not NaN.
Estimate mean_of(const RealismReport& report, double SceneRealism::* member);
Estimate mean_of(const RealismReport& report, RealismFeature feature);
/// Group of features: kinematic, interactive or map. In each scene, a group's likelihood is the weighted mean of its
/// features' likelihoods.
struct RealismGroup {
  const char* name;
  std::vector<RealismFeature> features;
};
const std::vector<RealismGroup>& realism_groups();
Estimate mean_of(const RealismReport& report, const RealismGroup& group);

/// Returns the report as one JSON object; add_estimate() writes each estimate as two keys.
Json realism_json(const RealismReport& report);

}  // namespace pictura
