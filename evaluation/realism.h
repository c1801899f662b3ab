// The realism score: how likely recorded road users are under what simulated rollouts do, and other measures of
// rollouts: displacement, events, time to collision, comfort and progress. docs/explanation/realism.md has the
// definitions and their sources. Without torch headers.
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

/// How one feature is scored.
struct RealismTerm {
  double weight = 0;         // the weights of all terms sum to 1
  double low = 0, high = 0;  // values are cut off at these
  int bins = 0;              // 0: the feature is an event, once a rollout or never
  double smoothing = 0;      // added to the count of every bin
};

/// The weights and bins of one year's challenge.
struct RealismVersion {
  std::string name;
  std::array<RealismTerm, kNumRealismFeatures> terms;  // by RealismFeature
};
const std::vector<RealismVersion>& realism_versions();
std::vector<std::string> realism_version_names();
/// Throws UsageError listing the names.
const RealismVersion& realism_version(const std::string& name);

/// The steps of the recording that precede the rollouts, and theirs.
constexpr int32_t kRealismStart = 10, kRealismSteps = 80;

using RealismLikelihoods = std::array<double, kNumRealismFeatures>;

/// What rollouts of one scene get. NaN where the scene has nothing to score.
struct SceneRealism {
  std::string scenario_id;
  int rollouts = 0, scored = 0;  // scored road users
  // In (0, 1]. pooled: exp of the mean log-likelihood over all road users and steps; by_object: the mean over road
  // users of exp of the mean over steps.
  RealismLikelihoods pooled, by_object;
  double score = 0, score_by_object = 0;  // weighted means of these, over the features that the scene has
  double ade_m = 0, min_ade_m = 0;        // mean over rollouts, and least of one rollout, of means over road users
  // Shares of scored road users with such an event in a rollout, and in the recording.
  double collision_rate = 0, off_road_rate = 0, red_light_rate = 0;
  double recorded_collision_rate = 0, recorded_off_road_rate = 0, recorded_red_light_rate = 0;
  // Means over scored vehicles: share of steps with a time to collision below kShortTimeToCollision_s, share of
  // vehicles within all bounds of comfort, and share of the recorded path that is passed.
  double short_time_to_collision = 0, recorded_short_time_to_collision = 0;
  double comfort = 0, recorded_comfort = 0;
  double progress = 0;
};
constexpr double kShortTimeToCollision_s = 0.95;

/// A scene as the score asks for it.
class RealismScene {
 public:
  /// Throws Error naming the scene where it has no step after kRealismStart, steps other than 0.1 s, or no road user to
  /// score. Scored are the self-driving car and the tracks to predict, as far as they are there at kRealismStart;
  /// where the scene names no tracks to predict, all that are there.
  explicit RealismScene(std::shared_ptr<const Scenario> scenario);

  const Scenario& scenario() const { return *scenario_; }
  /// The ids of the tracks that are there at kRealismStart, all of which rollouts have, and of those that are scored.
  std::vector<int64_t> track_ids() const;
  std::vector<int64_t> scored_ids() const;

  const RealismFeatures& recorded_features() const { return recorded_features_; }
  /// One rollout's. Throws Error naming the track that is missing, unknown, or twice there, or the state that is not
  /// finite.
  RealismFeatures features(const SceneRollouts& rollouts, size_t rollout) const;

  /// Throws as features() does, and where there is no rollout.
  SceneRealism score(const SceneRollouts& rollouts, const RealismVersion& version) const;

 private:
  size_t num_poses() const { return kRealismHistory + static_cast<size_t>(kRealismSteps); }
  /// [objects][num_poses]
  std::vector<RealismPose> poses_of(const SceneRollouts& rollouts, size_t rollout) const;
  RealismFeatures features_of(const std::vector<RealismPose>& poses) const;
  double progress_of(size_t object, const RealismPose& end) const;

  std::shared_ptr<const Scenario> scenario_;
  RealismRoad road_;
  std::vector<int32_t> tracks_;  // tracks of the objects
  std::vector<RealismObject> objects_;
  std::vector<size_t> scored_;  // indices of objects
  std::vector<RealismPose> recorded_;
  RealismFeatures recorded_features_;
};

/// The log-likelihoods of recorded values of one road user under the simulated ones, [steps]; NaN where the recorded
/// value is NaN. Simulated values that are NaN are left out; where none is left, every value is NaN.
std::vector<double> log_likelihoods(const RealismTerm& term, Span<const double> recorded, Span<const double> simulated);
/// The log-likelihood of a recorded event, or of its absence, if `count` of `rollouts` have the event.
double event_log_likelihood(const RealismTerm& term, bool recorded, int count, int rollouts);

/// The scores of many scenes.
struct RealismReport {
  std::string version;
  std::vector<SceneRealism> scenes;
  std::vector<std::string> faults;  // scenes that cannot be read or scored, and why
  int without_rollouts = 0;         // scenes that the file of rollouts does not have
  std::vector<std::string> unused;  // scenario ids of rollouts without a scene
};

/// Scores the rollouts of a file by the scenes of that name, as find_scenes() takes them. Throws Error where the file
/// cannot be read or not one scene is scored. on_progress(share done) is called by the calling thread.
RealismReport score_rollouts(const std::string& path, const std::vector<std::string>& scenes,
                             const RealismVersion& version, int num_threads,
                             const std::function<void(double)>& on_progress = {});

/// Mean over the scenes that have it.
Estimate mean_of(const RealismReport& report, double SceneRealism::* member);
Estimate mean_of(const RealismReport& report, RealismFeature feature);
/// The weighted mean of a group's likelihoods, scene by scene: kinematic, interactive or map.
struct RealismGroup {
  const char* name;
  std::vector<RealismFeature> features;
};
const std::vector<RealismGroup>& realism_groups();
Estimate mean_of(const RealismReport& report, const RealismGroup& group);

/// As one object; estimates as two keys, see add_estimate().
Json realism_json(const RealismReport& report);

}  // namespace pictura
