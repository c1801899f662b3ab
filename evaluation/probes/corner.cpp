#include "pictura/evaluation/probes/corner.h"

#include <algorithm>
#include <map>
#include <set>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/evaluation/probes/probe_run.h"
#include "pictura/evaluation/probes/takeover.h"

namespace pictura {

namespace {

// Reports the progress of driving as the first half of the probe's progress.
CornerOptions with_half_progress(CornerOptions options) {
  if (const auto report = options.worlds.on_progress) {
    options.worlds.on_progress = [report, since_start = Stopwatch()](double done, double eta_s) {
      report(done / 2, 2 * eta_s + since_start.seconds());  // assumes that the second half takes as long as the first
    };
  }
  return options;
}

class CornerProbe {
 public:
  CornerProbe(const std::vector<PolicySession*>& sessions, const CornerOptions& options, CornerResults* results_out)
      : report_(options.worlds.on_progress),
        options_(with_half_progress(options)),
        results_(*results_out),
        run_(sessions, options_, results_out, {.untrained = options.control == CornerControl::untrained}) {
    results_.maps = run_.maps();
    for (const auto& map : run_.maps()) {
      corners_.push_back(find_blind_corners(*map->road, map->geometry.walls));
      sights_.emplace_back(map->geometry.walls);
    }
  }

  void run() {
    run_.run([this](const ProbeFrame& frame) { find_corners(frame); },
             [this](Simulator& simulator, int driver) {
               driven_ = &simulator;
               scenes_.add(simulator, driver);
             });
    if (!results_.interrupted) choose_pairs();
    if (!results_.interrupted) take_over();
    if (report_ && !results_.interrupted) report_(1, 0);
    results_.seconds = since_start_.seconds();
  }

 private:
  // State with a hidden vehicle, and its world.
  struct Found {
    CornerState state;
    CornerScene scene;
  };

  void find_corners(const ProbeFrame& frame) {
    // At later steps, the scene has too few steps left for a takeover.
    if (frame.step + kTakeoverSteps >= options_.worlds.steps) return;
    KeptScene kept;
    std::vector<View> views;
    std::vector<VisibilityQuery> queries;
    std::vector<Found> hidden;
    std::vector<size_t> found_in;  // indices of worlds
    for (size_t world = 0; world < frame.worlds.size(); ++world) {
      const auto map = static_cast<size_t>(frame.worlds[world].map);
      bool is_kept = false, is_found = false;
      for (const CornerState& state : find_corner_states(frame, world, *run_.maps()[map]->road, corners_[map],
                                                         sights_[map], run_.front_camera(), options_.search)) {
        is_found = true;
        if (state.user < 0) {
          empty_.push_back(state);
          continue;
        }
        if (!is_kept) kept.add_world(frame, world);
        is_kept = true;
        queries.push_back(
            {static_cast<int32_t>(views.size()), kept.box_of(frame, world, frame.box_begin[world] + state.user)});
        views.push_back(kept.view_of(frame, world, frame.slot_begin[world] + state.ego, {}));
        hidden.push_back({state, scene_of(frame, world)});
      }
      if (is_found) found_in.push_back(world);
    }
    keep(frame, found_in);
    const std::vector<float> shares = run_.visibility(kept, views, queries);
    for (size_t i = 0; i < shares.size(); ++i) {
      if (!(shares[i] > 0)) hidden_.push_back(std::move(hidden[i]));
    }
  }

  // Keeps the worlds of the frame in which policies may take over, until pairs are chosen. A world takes some 50 KB.
  void keep(const ProbeFrame& frame, const std::vector<size_t>& worlds) {
    if (worlds.empty()) return;
    const std::vector<uint8_t> saved = driven_->save(current_stream(run_.device()));
    const auto kept = extract_worlds(*driven_, saved, worlds);
    for (size_t i = 0; i < worlds.size(); ++i) kept_[{frame.scene_of(worlds[i]), frame.step}] = kept[i];
  }

  static CornerScene scene_of(const ProbeFrame& frame, size_t world) {
    CornerScene scene;
    scene.boxes.assign(frame.boxes.begin() + frame.box_begin[world], frame.boxes.begin() + frame.box_begin[world + 1]);
    scene.status.assign(scene.boxes.size(), AgentStatus::parked);
    std::copy(frame.status.begin() + frame.slot_begin[world], frame.status.begin() + frame.slot_begin[world + 1],
              scene.status.begin());
    return scene;
  }

  // Returns whether the hidden vehicle enters the junction within kTakeoverSteps.
  bool enters_junction(const CornerState& state) const {
    const auto map = static_cast<size_t>(state.map);
    const int32_t junction = corners_[map].at(state.approach).junction;
    const DrivenScene& scene = scenes_.of(state.scene);
    for (int step = state.step; step <= state.step + kTakeoverSteps; ++step) {
      const int32_t lane = scene.at(step, state.user).lane;
      if (lane >= 0 && run_.maps()[map]->road->lanes[lane].junction == junction) return true;
    }
    return false;
  }

  void choose_pairs() {
    std::vector<CornerState> coming;
    for (const Found& found : hidden_) {
      if (enters_junction(found.state)) coming.push_back(found.state);
    }
    results_.hidden_found = static_cast<int64_t>(coming.size());
    results_.empty_found = static_cast<int64_t>(empty_.size());
    results_.pairs = match_corners(coming, empty_, options_.pairs);
    std::set<std::pair<int32_t, int32_t>> used;
    for (const CornerPair& pair : results_.pairs) {
      for (const CornerState* state : {&pair.hidden, &pair.empty}) used.insert({state->scene, state->step});
    }
    std::erase_if(kept_, [&used](const auto& one) { return !used.contains(one.first); });
    for (const CornerPair& pair : results_.pairs) {
      const CornerState& state = pair.hidden;
      const auto found = std::find_if(hidden_.begin(), hidden_.end(), [&state](const Found& one) {
        return one.state.scene == state.scene && one.state.step == state.step && one.state.ego == state.ego;
      });
      CornerScene scene = found->scene;
      for (int step = 0; step <= kTakeoverSteps; ++step)
        scene.user_m.push_back(scenes_.of(state.scene).box_at(state.step + step, state.user).center_m.xy());
      scene.removed = options_.control == CornerControl::permuted ? draw_other_vehicle(scene, state) : state.user;
      results_.scenes_of_pairs.push_back(std::move(scene));
    }
  }

  // Returns a random vehicle near the ego other than the hidden vehicle; -1: none. The seed determines the choice.
  int32_t draw_other_vehicle(const CornerScene& scene, const CornerState& state) const {
    std::vector<int32_t> others;
    const auto num_agents = static_cast<int32_t>(scenes_.of(state.scene).bodies.size());
    const Vec2 ego_m = scene.boxes[state.ego].center_m.xy();
    for (int32_t agent = 0; agent < num_agents; ++agent) {
      const AgentBox& box = scene.boxes[agent];
      if (agent == state.ego || agent == state.user || !box.drawn || box.agent_class != AgentClass::vehicle) continue;
      if (length(box.center_m.xy() - ego_m) < options_.search.user_range_m) others.push_back(agent);
    }
    if (others.empty()) return -1;
    RandomStream random({.seed = options_.worlds.seed,
                         .world = static_cast<uint32_t>(state.scene),
                         .agent = static_cast<uint32_t>(state.ego),
                         .step = static_cast<uint32_t>(state.step),
                         .purpose = Purpose::corner_user});
    return others[random.below(static_cast<int>(others.size()))];
  }

  void take_over() {
    TakeoverWorlds worlds(run_, options_, sights_);
    const auto pass = static_cast<size_t>(takeover_pass(run_.device()));
    const size_t batch = (static_cast<size_t>(options_.batch) + pass - 1) / pass * pass, count = results_.pairs.size(),
                 num_policies = results_.policies.size(), of_pair = 2 * kCornerCases * num_policies;
    const Stopwatch since_driven;
    for (size_t begin = 0; begin < count; begin += batch) {
      const size_t end = std::min(begin + batch, count);
      results_.takeovers.resize(end * of_pair);
      for (size_t part = 0; part < 2 * kCornerCases; ++part) {
        std::vector<TakeoverStart> starts;
        for (size_t pair = begin; pair < end; ++pair)
          starts.push_back(start_of(pair, static_cast<CornerCase>(part % kCornerCases)));
        std::vector<Takeover> runs;
        const auto report = [&](double part_done) {
          const double of_batch = (static_cast<double>(part) + part_done) / static_cast<double>(2 * kCornerCases);
          const double done =
              (static_cast<double>(begin) + static_cast<double>(end - begin) * of_batch) / static_cast<double>(count);
          if (report_) report_((1 + done) / 2, since_driven.seconds() * (1 - done) / done);
        };
        if (!worlds.run(starts, part < kCornerCases, report, &runs)) {
          results_.interrupted = true;
          results_.takeovers.resize(begin * of_pair);
          results_.pairs.resize(begin);
          results_.scenes_of_pairs.resize(begin);
          return;
        }
        for (size_t i = 0; i < starts.size(); ++i) {
          std::copy_n(
              runs.begin() + static_cast<std::ptrdiff_t>(i * num_policies), num_policies,
              results_.takeovers.begin() + static_cast<std::ptrdiff_t>((begin + i) * of_pair + part * num_policies));
        }
      }
    }
  }

  TakeoverStart start_of(size_t pair, CornerCase its_case) const {
    const CornerPair& both = results_.pairs[pair];
    const CornerState& state = its_case == CornerCase::empty ? both.empty : both.hidden;
    const int32_t removed = its_case == CornerCase::removed ? results_.scenes_of_pairs[pair].removed : -1;
    return {&scenes_.of(state.scene),
            kept_.at({state.scene, state.step}).get(),
            state.step,
            state.ego,
            state.user,
            removed};
  }

  const std::function<void(double, double)> report_;
  const CornerOptions options_;
  CornerResults& results_;
  const Stopwatch since_start_;
  ProbeRun run_;
  DrivenScenes scenes_;
  std::vector<BlindCorners> corners_;  // [maps]
  std::vector<LineOfSight> sights_;    // [maps]
  Simulator* driven_ = nullptr;
  std::map<std::pair<int32_t, int32_t>, std::shared_ptr<const SavedWorld>> kept_;  // key: scene and step
  std::vector<Found> hidden_;
  std::vector<CornerState> empty_;
};

void check(const CornerOptions& options) {
  const CornerSearch& search = options.search;
  PICTURA_CHECK(options.worlds.adds_walls, "probe: expected worlds with walls");
  if (options.pairs < 1) fail_usage("probe: expected one pair or more, got {}", options.pairs);
  if (options.worlds.steps <= kTakeoverSteps + options.sample_steps) {
    fail_usage("probe: expected more than {} steps, of which a takeover takes {}, got {}",
               kTakeoverSteps + options.sample_steps, kTakeoverSteps, options.worlds.steps);
  }
  if (!(search.min_distance_m >= 0 && search.max_distance_m > search.min_distance_m &&
        search.max_distance_m <= kCornerLead_m)) {
    fail_usage("probe: expected distances of 0 to {} m in ascending order, got {} and {}", kCornerLead_m,
               search.min_distance_m, search.max_distance_m);
  }
  if (!(search.user_range_m > 0 && search.user_range_m <= kCornerLead_m)) {
    fail_usage("probe: expected a range of up to {} m, got {}", kCornerLead_m, search.user_range_m);
  }
}

}  // namespace

CornerResults probe_corner(const CornerOptions& options) { return with_opened(options, probe_corner); }

CornerResults probe_corner(const std::vector<PolicySession*>& sessions, const CornerOptions& options) {
  check_probe(options, sessions.size());
  check(options);
  CornerResults results;
  results.pairs_asked = options.pairs;
  results.search = options.search;
  results.control = options.control;
  CornerProbe(sessions, options, &results).run();
  return results;
}

}  // namespace pictura
