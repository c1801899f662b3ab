#include "pictura/evaluation/probes/removal.h"

#include <algorithm>
#include <tuple>

#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/evaluation/probes/probe_run.h"

namespace pictura {

namespace {

// Case, and the indices of its world and agents in a frame.
struct DrawnCase {
  RemovalCase facts;
  size_t world = 0;
  int32_t slot = 0;  // slot of the ego
  int32_t user_box = 0, hidden_box = -1;
};

class RemovalProbe {
 public:
  RemovalProbe(const std::vector<PolicySession*>& sessions, const RemovalOptions& options, RemovalResults* results_out)
      : options_(options),
        results_(*results_out),
        run_(sessions, options, results_out, {.untrained = options.control == RemovalControl::untrained}),
        quota_(options.removals, options) {}

  void run() {
    const std::vector<float> shares = run_.run([this](const ProbeFrame& frame) { sample(frame); });
    for (size_t i = 0; i < shares.size(); ++i) results_.cases[i].visible_share = shares[i];
    sort_cases();
  }

 private:
  // Draws cases of this step from all worlds.
  void sample(const ProbeFrame& frame) {
    std::vector<DrawnCase> drawn;
    for (size_t world = 0; world < frame.worlds.size(); ++world) {
      const int32_t scene = frame.scene_of(world);
      const int64_t due = quota_.due(scene, frame.step);
      if (due == 0) continue;
      const std::vector<DrawnCase> pairs = pairs_of(frame, world);
      const auto count = std::min(due, static_cast<int64_t>(pairs.size()));
      quota_.take(scene, count);
      draw(frame, pairs, static_cast<int>(count), &drawn);
    }
    std::vector<ProbePair> pairs;
    for (const DrawnCase& one : drawn) {
      results_.cases.push_back(one.facts);
      pairs.push_back(
          {.world = one.world, .slot = one.slot, .hidden_box = one.hidden_box, .measured_box = one.user_box});
    }
    run_.add_pairs(frame, pairs);
  }

  // Returns all egos of a world with each of their road users, by ego and user.
  std::vector<DrawnCase> pairs_of(const ProbeFrame& frame, size_t world) const {
    const WorldSpec& spec = frame.worlds[world];
    const int32_t first_slot = frame.slot_begin[world], first_box = frame.box_begin[world];
    std::vector<DrawnCase> pairs;
    for (int32_t ego = 0; ego < spec.num_agents; ++ego) {
      const auto slot = static_cast<size_t>(first_slot + ego);
      if (!frame.is_ego(slot)) continue;
      for (int32_t user = 0; user < spec.num_agents; ++user) {
        const auto user_slot = static_cast<size_t>(first_slot + user);
        if (user == ego || !frame.is_present(user_slot)) continue;
        const Vec2 apart = frame.boxes[first_box + user].center_m.xy() - frame.views[slot].origin_m.xy();
        const float distance_m = length(apart);
        if (distance_m > options_.range_m) continue;
        RemovalCase facts;
        facts.scene = frame.scene_of(world);
        facts.map = spec.map;
        facts.driver = frame.driver;
        facts.step = frame.step;
        facts.ego = ego;
        facts.user = user;
        facts.user_class = frame.agent_class[user_slot];
        facts.user_halted = frame.status[user_slot] == AgentStatus::halted;
        facts.distance_m = distance_m;
        facts.ego_speed_mps = frame.speed_mps[slot];
        pairs.push_back({facts, world, first_slot + ego, first_box + user});
      }
    }
    return pairs;
  }

  // Draws distinct pairs of a world, and for each pair the agent to hide.
  void draw(const ProbeFrame& frame, const std::vector<DrawnCase>& pairs, int count,
            std::vector<DrawnCase>* out) const {
    std::vector<int> order(pairs.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
    const auto first = static_cast<std::ptrdiff_t>(out->size());
    for (int i = 0; i < count; ++i) {
      RandomStream random({.seed = options_.worlds.seed,
                           .world = frame.worlds[pairs[0].world].global_world,
                           .agent = static_cast<uint32_t>(i) % RandomKey::kMaxAgents,
                           .episode = static_cast<uint32_t>(i) / RandomKey::kMaxAgents,
                           .step = static_cast<uint32_t>(frame.step),
                           .purpose = Purpose::removal_case});
      const auto chosen = static_cast<size_t>(i + random.below(static_cast<int>(order.size()) - i));
      std::swap(order[i], order[chosen]);
      DrawnCase one = pairs[order[i]];
      const int32_t first_box = frame.box_begin[one.world];
      one.facts.hidden = hidden_of(pairs, one, &random);
      if (one.facts.hidden >= 0) one.hidden_box = first_box + one.facts.hidden;
      out->push_back(one);
    }
    std::sort(out->begin() + first, out->end(), [](const DrawnCase& a, const DrawnCase& b) {
      return std::pair(a.facts.ego, a.facts.user) < std::pair(b.facts.ego, b.facts.user);
    });
  }

  int32_t hidden_of(const std::vector<DrawnCase>& pairs, const DrawnCase& one, RandomStream* random) const {
    if (options_.control == RemovalControl::unchanged) return -1;
    if (options_.control != RemovalControl::permuted) return one.facts.user;
    std::vector<int32_t> others;
    for (const DrawnCase& pair : pairs) {
      if (pair.slot == one.slot && pair.facts.user != one.facts.user) others.push_back(pair.facts.user);
    }
    return others.empty() ? -1 : others[random->below(static_cast<int>(others.size()))];
  }

  // Sorts cases by scene, step, ego and user, independent of the order in which they were drawn.
  void sort_cases() {
    const std::vector<size_t> order = sorted_order(results_.cases.size(), [this](size_t i) {
      const RemovalCase& one = results_.cases[i];
      return std::tuple(one.scene, one.step, one.ego, one.user);
    });
    std::vector<RemovalCase> cases;
    std::vector<PairedResponse> responses;
    for (const size_t i : order) {
      cases.push_back(results_.cases[i]);
      for (size_t policy = 0; policy < results_.policies.size(); ++policy)
        responses.push_back(results_.response(i, policy));
    }
    results_.cases = std::move(cases);
    results_.responses = std::move(responses);
  }

  const RemovalOptions& options_;
  RemovalResults& results_;
  ProbeRun run_;
  CaseQuota quota_;
};

void check(const RemovalOptions& options) {
  if (options.removals < 1) fail_usage("probe: expected one removal or more, got {}", options.removals);
  if (!(options.range_m > 0)) fail_usage("probe: expected a range above 0 m, got {}", options.range_m);
}

}  // namespace

RemovalResults probe_removal(const RemovalOptions& options) { return with_opened(options, probe_removal); }

RemovalResults probe_removal(const std::vector<PolicySession*>& sessions, const RemovalOptions& options) {
  check_probe(options, sessions.size());
  check(options);
  RemovalResults results;
  results.removals_asked = options.removals;
  results.range_m = options.range_m;
  results.control = options.control;
  RemovalProbe(sessions, options, &results).run();
  return results;
}

}  // namespace pictura
