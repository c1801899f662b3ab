#include "pictura/evaluation/probes/pedestrian.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <tuple>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/evaluation/probes/crossing_path.h"
#include "pictura/evaluation/probes/probe_run.h"

namespace pictura {

namespace {

// Maximum number of paths tried in one world and step, and number of paths tried per call. The second number does not
// change results.
constexpr size_t kMaxTries = 48, kTriesAtOnce = 12;
// Interval between the points of a tried path that are measured first. Every phase of a usable path is at least this
// long, so every phase contains a measured point.
constexpr int kCoarse = 4;
static_assert(kPathOrigin % kCoarse == 0 && kCoarse * kPathSpacing_m <= min_of(kPathHidden_m, kPathSeen_m));
constexpr float kMinHiderDistance_m = 5, kSameHeight_m = 0.5f;
constexpr float kMinCosineAhead = 0.7f;  // cosine of the angle between the ego's heading and the hider

// Candidate path in a world of a frame.
struct Candidate {
  int32_t ego = 0, hider = 0;
  CrossingPath path;
};

// State of the search in one world: its remaining candidates.
struct Search {
  size_t world = 0;
  int64_t due = 0;
  std::vector<Candidate> candidates;
  size_t next = 0;
};

// Candidate that is being measured.
struct Trial {
  Search* search = nullptr;
  const Candidate* one = nullptr;
  std::vector<bool> is_free{};  // [kPathPoints] whether a pedestrian can stand there
  std::vector<float> shares = std::vector<float>(kPathPoints, std::numeric_limits<float>::quiet_NaN());
  float share_without_hider = 0;  // at the origin

  // Returns whether the path may be usable, judged by the points that are measured first. The hider must hide the
  // pedestrian at the origin; beyond the origin, the pedestrian must be seen and then hidden again.
  bool is_promising() const {
    if (shares[kPathOrigin] != 0 || !(share_without_hider > 0)) return false;
    int i = kPathOrigin;
    const auto share = [&] { return i < kPathPoints ? shares[i] : -1; };
    while (share() == 0) i += kCoarse;
    if (!(share() > 0)) return false;
    while (share() > 0) i += kCoarse;
    return share() == 0;
  }
};

class PedestrianProbe {
 public:
  PedestrianProbe(const std::vector<PolicySession*>& sessions, const PedestrianOptions& options,
                  PedestrianResults* results_out)
      : options_(options),
        results_(*results_out),
        run_(sessions, options, results_out, {.untrained = options.control == PedestrianControl::untrained}),
        quota_(options.paths, options) {
    results_.maps = run_.maps();
    results_.cameras = run_.cameras();
  }

  void run() {
    run_.run([this](const ProbeFrame& frame) { sample(frame); });
    sort_paths();
  }

 private:
  // Searches all worlds for paths at this step.
  void sample(const ProbeFrame& frame) {
    std::vector<Search> searches;
    for (size_t world = 0; world < frame.worlds.size(); ++world) {
      const int64_t due = quota_.due(frame.scene_of(world), frame.step);
      if (due > 0) searches.push_back({world, due, candidates_of(frame, world)});
    }
    while (measure_candidates(frame, &searches)) continue;
  }

  // Returns all paths of a pedestrian from behind a vehicle in a world, in a random order.
  std::vector<Candidate> candidates_of(const ProbeFrame& frame, size_t world) const {
    std::vector<Candidate> all;
    const WorldSpec& spec = frame.worlds[world];
    const int32_t first_slot = frame.slot_begin[world], first_box = frame.box_begin[world];
    for (int32_t ego = 0; ego < spec.num_agents; ++ego) {
      const auto slot = static_cast<size_t>(first_slot + ego);
      if (!frame.is_ego(slot) || frame.speed_mps[slot] < options_.min_speed_mps) continue;
      const View& view = frame.views[slot];
      const Vec2 heading{view.cos_heading, view.sin_heading};
      for (int32_t box = first_box; box < frame.box_begin[world + 1]; ++box) {
        const AgentBox& hider = frame.boxes[box];
        if (box == first_box + ego || !hider.drawn || hider.agent_class != AgentClass::vehicle) continue;
        const Vec2 apart = hider.center_m.xy() - view.origin_m.xy();
        const float distance_m = length(apart);
        if (distance_m < kMinHiderDistance_m || distance_m > options_.hider_range_m) continue;
        if (dot(apart, heading) < kMinCosineAhead * distance_m) continue;
        if (std::abs(hider.center_m.z - view.origin_m.z) > kSameHeight_m) continue;
        for (const CrossingPath& path : paths_behind(hider, view.origin_m.xy()))
          all.push_back({ego, box - first_box, path});
      }
    }
    for (size_t i = 0; i < std::min(kMaxTries, all.size()); ++i) {
      RandomStream random({.seed = options_.worlds.seed,
                           .world = spec.global_world,
                           .agent = static_cast<uint32_t>(i),
                           .step = static_cast<uint32_t>(frame.step),
                           .purpose = Purpose::pedestrian_path});
      std::swap(all[i], all[i + static_cast<size_t>(random.below(static_cast<int>(all.size() - i)))]);
    }
    all.resize(std::min(kMaxTries, all.size()));
    return all;
  }

  // Measures the next candidates of each world, and adds those that are usable. Returns false if there are none.
  bool measure_candidates(const ProbeFrame& frame, std::vector<Search>* searches) {
    std::vector<Trial> trials;
    for (Search& search : *searches) {
      if (search.due == 0) continue;
      for (size_t i = 0; i < kTriesAtOnce && search.next < search.candidates.size(); ++i)
        trials.push_back({&search, &search.candidates[search.next++]});
    }
    if (trials.empty()) return false;
    for (Trial& trial : trials) trial.is_free = free_points(frame, trial);
    measure(frame, kCoarse, &trials);
    std::erase_if(trials, [](const Trial& trial) { return !trial.is_promising(); });
    measure(frame, 1, &trials);
    for (const Trial& trial : trials) {
      if (trial.search->due > 0 && take(frame, trial)) --trial.search->due;
    }
    return true;
  }

  std::vector<bool> free_points(const ProbeFrame& frame, const Trial& trial) const {
    const size_t world = trial.search->world;
    const std::vector<WallFace>& walls = run_.maps()[frame.worlds[world].map]->geometry.walls;
    return pictura::free_points(trial.one->path, boxes_of(frame, world), walls);
  }

  static Span<const AgentBox> boxes_of(const ProbeFrame& frame, size_t world) {
    const int32_t first = frame.box_begin[world], end = frame.box_begin[world + 1];
    return Span<const AgentBox>(frame.boxes).subspan(first, end - first);
  }

  // Measures the visibility of the pedestrian at every stride-th free point, and at the origin without the hider.
  void measure(const ProbeFrame& frame, int stride, std::vector<Trial>* trials) {
    KeptScene scene;
    std::vector<View> views;
    std::vector<VisibilityQuery> queries;
    std::vector<float*> shares_out;
    for (Trial& trial : *trials) {
      const size_t world = trial.search->world;
      std::vector<InsertedBox> pedestrians;
      std::vector<float*> of_point;
      for (int i = 0; i < kPathPoints; i += stride) {
        if (!trial.is_free[i]) continue;
        pedestrians.push_back(trial.one->path.pedestrian(i, options_.height_m));
        of_point.push_back(&trial.shares[i]);
      }
      scene.add_world(frame, world, pedestrians);
      const int32_t first = scene.first_inserted(frame, world), slot = frame.slot_begin[world] + trial.one->ego;
      const auto count = static_cast<int32_t>(pedestrians.size());
      for (int32_t i = 0; i < count; ++i) {
        std::vector<int32_t> others;
        for (int32_t other = 0; other < count; ++other) {
          if (other != i) others.push_back(first + other);
        }
        const auto add = [&](float* share_out) {
          queries.push_back({static_cast<int32_t>(views.size()), first + i});
          views.push_back(scene.view_of(frame, world, slot, others));
          shares_out.push_back(share_out);
        };
        float* const share = of_point[i];
        add(share);
        if (share != &trial.shares[kPathOrigin]) continue;
        others.push_back(scene.box_of(frame, world, frame.box_begin[world] + trial.one->hider));
        add(&trial.share_without_hider);
      }
    }
    const std::vector<float> shares = run_.visibility(scene, views, queries);
    for (size_t i = 0; i < shares.size(); ++i) *shares_out[i] = shares[i];
  }

  bool take(const ProbeFrame& frame, const Trial& trial) {
    const Candidate& one = *trial.one;
    const size_t world = trial.search->world;
    const WorldSpec& spec = frame.worlds[world];
    const int32_t scene = frame.scene_of(world);
    // A state is used once per ego.
    const bool is_taken = std::any_of(results_.paths.begin(), results_.paths.end(), [&](const PedestrianPath& path) {
      return path.scene == scene && path.step == frame.step && path.ego == one.ego;
    });
    const std::optional<PathPart> part = usable_part(trial.shares);
    if (is_taken || !part) return false;

    const Span<const AgentBox> boxes = boxes_of(frame, world);
    const int32_t slot = frame.slot_begin[world] + one.ego;
    const auto ego = static_cast<size_t>(slot);
    PedestrianPath path{.scene = scene,
                        .map = spec.map,
                        .driver = frame.driver,
                        .map_origin_m = run_.maps()[spec.map]->road->origin_m,
                        .step = frame.step,
                        .ego = one.ego,
                        .hider = one.hider,
                        .ego_speed_mps = frame.speed_mps[ego],
                        .first_point = static_cast<int32_t>(results_.points.size()),
                        .num_points = part->end - part->begin,
                        .first_seen = part->first_seen - part->begin,
                        .hidden_again = part->hidden_again - part->begin,
                        .boxes = {boxes.begin(), boxes.end()},
                        .view = frame.views[ego]};
    const Vec2 eye_m = path.view.origin_m.xy();
    path.hider_distance_m = length(path.boxes[one.hider].center_m.xy() - eye_m);
    path.view.world = 0;
    path.view.ego_agent = one.ego;
    const auto first_slot = frame.status.begin() + frame.slot_begin[world];
    path.status.assign(path.boxes.size(), AgentStatus::parked);
    std::copy(first_slot, first_slot + spec.num_agents, path.status.begin());
    path.lights.assign(frame.lights.begin() + frame.light_begin[world],
                       frame.lights.begin() + frame.light_begin[world + 1]);

    std::vector<ProbePair> pairs;
    for (int i = part->begin; i < part->end; ++i) {
      const InsertedBox pedestrian = one.path.pedestrian(i, options_.height_m);
      results_.points.push_back({.path = static_cast<int32_t>(results_.paths.size()),
                                 .along_m = kPathSpacing_m * static_cast<float>(i - part->begin),
                                 .pedestrian = pedestrian.box,
                                 .distance_m = length(one.path.point_m(i) - eye_m),
                                 .visible_share = trial.shares[i]});
      pairs.push_back({.world = world, .slot = slot});
      if (options_.control != PedestrianControl::unchanged) pairs.back().inserted = pedestrian;
    }
    results_.paths.push_back(std::move(path));
    quota_.take(scene, 1);
    run_.add_pairs(frame, pairs);
    return true;
  }

  // Sorts paths by scene, step, ego and hider, independent of the order in which they were found.
  void sort_paths() {
    const std::vector<size_t> order = sorted_order(results_.paths.size(), [this](size_t i) {
      const PedestrianPath& one = results_.paths[i];
      return std::tuple(one.scene, one.step, one.ego, one.hider);
    });
    std::vector<PedestrianPath> paths;
    std::vector<PedestrianPoint> points;
    std::vector<PairedResponse> responses;
    for (const size_t i : order) {
      PedestrianPath& path = results_.paths[i];
      const auto first = static_cast<size_t>(path.first_point);
      path.first_point = static_cast<int32_t>(points.size());
      for (size_t point = first; point < first + static_cast<size_t>(path.num_points); ++point) {
        points.push_back(results_.points[point]);
        points.back().path = static_cast<int32_t>(paths.size());
        for (size_t policy = 0; policy < results_.policies.size(); ++policy)
          responses.push_back(results_.response(point, policy));
      }
      paths.push_back(std::move(path));
    }
    results_.paths = std::move(paths);
    results_.points = std::move(points);
    results_.responses = std::move(responses);
  }

  const PedestrianOptions& options_;
  PedestrianResults& results_;
  ProbeRun run_;
  CaseQuota quota_;
};

void check(const PedestrianOptions& options) {
  if (options.paths < 1) fail_usage("probe: expected one path or more, got {}", options.paths);
  if (!(options.hider_range_m > kMinHiderDistance_m)) {
    fail_usage("probe: expected a range above {} m, got {}", kMinHiderDistance_m, options.hider_range_m);
  }
  if (!(options.height_m > 0)) fail_usage("probe: expected a height above 0 m, got {}", options.height_m);
}

}  // namespace

PedestrianResults probe_pedestrian(const PedestrianOptions& options) { return with_opened(options, probe_pedestrian); }

PedestrianResults probe_pedestrian(const std::vector<PolicySession*>& sessions, const PedestrianOptions& options) {
  check_probe(options, sessions.size());
  check(options);
  PedestrianResults results;
  results.paths_asked = options.paths;
  results.hider_range_m = options.hider_range_m;
  results.min_speed_mps = options.min_speed_mps;
  results.height_m = options.height_m;
  results.control = options.control;
  PedestrianProbe(sessions, options, &results).run();
  return results;
}

}  // namespace pictura
