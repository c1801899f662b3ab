#include "pictura/evaluation/probes/takeover.h"

#include <algorithm>
#include <cmath>

#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/camera.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/evaluation/probes/corner_states.h"
#include "pictura/evaluation/probes/observation_rows.h"
#include "pictura/evaluation/probes/probe_run.h"
#include "pictura/policy/host_passes.h"
#include "pictura/policy/rules/choose_action.h"
#include "pictura/simulator/rules/observe.h"

namespace pictura {

namespace {

// Returns whether a box is among the nearest road users in an ego's vector observation.
bool is_partner(Span<const AgentBox> boxes, int32_t box, int32_t ego, Vec2 origin_m) {
  const auto nearest = nearest_boxes(
      static_cast<int>(boxes.size()), [&](int i) -> const AgentBox& { return boxes[i]; },
      [ego](int i) { return i != ego; }, origin_m, SingleThread{});
  for (int i = 0; i < nearest.count(); ++i) {
    if (nearest.item(i) == box) return true;
  }
  return false;
}

}  // namespace

// Simulator with a world for each start.
struct TakeoverWorlds::Worlds {
  std::unique_ptr<Simulator> simulator;
  std::unique_ptr<StateSnapshot> at_takeover;  // snapshot of the starts of the current call
  std::unique_ptr<ObservationRows> rows;
  int64_t num_rows = 0;
  std::vector<int32_t> first_slots;  // [starts + 1]
  std::vector<View> views;           // [starts] views of the egos in the current state
};

TakeoverWorlds::TakeoverWorlds(ProbeRun& run, const ProbeOptions& options, const std::vector<LineOfSight>& sights)
    : run_(run), options_(options), sights_(sights) {
  const CompiledMaps& maps = run_.maps();
  std::vector<std::shared_ptr<const RoadMap>> roads;
  for (const auto& map : maps) roads.push_back(map->road);
  MapOptions open = maps[0]->options;
  open.walls = false;
  open_maps_ = compile_maps(roads, open, options.worlds.num_threads);
  upload_maps(open_maps_, handles_of(false), &run_.measuring());
  for (size_t policy = 0; policy < options.policies.size(); ++policy) {
    if (run_.renderer(policy)) upload_maps(open_maps_, handles_of(false), run_.renderer(policy));
  }
}

TakeoverWorlds::~TakeoverWorlds() = default;

// Returns the maps' handles in renderers. Maps with walls have the handles under which the run uploaded them.
std::vector<GeometryHandle> TakeoverWorlds::handles_of(bool walls) const {
  std::vector<GeometryHandle> handles;
  for (size_t i = 0; i < sights_.size(); ++i) {
    handles.push_back(static_cast<GeometryHandle>(walls ? i : sights_.size() + i));
  }
  return handles;
}

bool TakeoverWorlds::run(const std::vector<TakeoverStart>& starts, bool walls,
                         const std::function<void(double)>& on_progress, std::vector<Takeover>* takeovers_out) {
  const size_t num_policies = options_.policies.size();
  takeovers_out->assign(starts.size() * num_policies, {});
  for (const auto& [kind, worlds] : worlds_) worlds->at_takeover.reset();
  for (size_t policy = 0; policy < num_policies; ++policy) {
    Worlds* const worlds = prepare(policy, starts, walls);
    std::vector<Takeover*> runs;
    for (size_t i = 0; i < starts.size(); ++i) runs.push_back(&(*takeovers_out)[i * num_policies + policy]);
    for (int step = 0; observe_step(worlds, policy, starts, step, runs) && step < kTakeoverSteps; ++step) {
      if (interrupted()) return false;
      const std::vector<int32_t> actions = decide(worlds, policy, starts, step);
      std::vector<Command> commands(static_cast<size_t>(worlds->simulator->num_slots()));
      for (size_t i = 0; i < starts.size(); ++i) {
        const TakeoverStart& start = starts[i];
        Command* const its_commands = &commands[worlds->first_slots[i]];
        start.scene->command_places(start.step + step + 1, its_commands);
        its_commands[start.ego] = {.action = actions[i]};
      }
      worlds->simulator->step(DeviceCopy(commands, run_.device()).span(), current_stream(run_.device()));
      on_progress((static_cast<double>(policy) + (step + 1.0) / kTakeoverSteps) / static_cast<double>(num_policies));
    }
  }
  return true;
}

// Prepares worlds that the policy observes, in the states at the takeover.
TakeoverWorlds::Worlds* TakeoverWorlds::prepare(size_t policy, const std::vector<TakeoverStart>& starts, bool walls) {
  SimulatorConfig config = run_.world_of(policy);
  config.walls = walls;
  std::unique_ptr<Worlds>& worlds =
      worlds_[{walls, config.auxiliary_observations, config.vector_observations, config.wall_observations}];
  const Stream stream = current_stream(run_.device());
  if (worlds && worlds->at_takeover) {
    worlds->simulator->restore(*worlds->at_takeover, stream);
    return worlds.get();
  }
  const CompiledMaps& maps = walls ? run_.maps() : open_maps_;
  std::vector<WorldSpec> specs;
  std::vector<const SavedWorld*> kept;
  for (const TakeoverStart& start : starts) {
    specs.push_back(start.scene->world);
    kept.push_back(start.world);
  }
  if (!worlds) {
    worlds = std::make_unique<Worlds>();
    worlds->simulator = make_simulator(options_.worlds.simulator, config, maps, specs);
  }
  Simulator& simulator = *worlds->simulator;
  simulator.set_worlds(maps, handles_of(walls), specs, options_.worlds.seed, stream);
  worlds->first_slots = host_copy(simulator.slots().slot_begin, run_.device());
  if (worlds->num_rows < static_cast<int64_t>(starts.size())) {
    worlds->num_rows = static_cast<int64_t>(starts.size());
    worlds->rows = std::make_unique<ObservationRows>(worlds->num_rows, simulator.config());
  }
  simulator.restore(saved_state_of(simulator, kept), stream);
  remove(worlds.get(), starts);
  worlds->at_takeover = simulator.snapshot(stream);
  return worlds.get();
}

// Removes the agents TakeoverStart::removed from their worlds.
void TakeoverWorlds::remove(Worlds* worlds, const std::vector<TakeoverStart>& starts) {
  std::vector<int32_t> slots;
  for (size_t i = 0; i < starts.size(); ++i) {
    if (starts[i].removed >= 0) slots.push_back(worlds->first_slots[i] + starts[i].removed);
  }
  if (slots.empty()) return;
  const Device device = run_.device();
  const auto count = static_cast<int64_t>(slots.size());
  const DeviceCopy<int32_t> which(slots, device);
  const DeviceCopy<AgentStatus> absent(std::vector<AgentStatus>(slots.size(), AgentStatus::absent), device);
  worlds->simulator->set_state(Array(which.span().data(), {count}, device),
                               std::vector<NamedArray>{{"status", Array(absent.span().data(), {count}, device)}},
                               current_stream(device));
}

// Records the current state in runs that have not ended. Returns false if all runs have ended.
bool TakeoverWorlds::observe_step(Worlds* worlds, size_t policy, const std::vector<TakeoverStart>& starts, int step,
                                  const std::vector<Takeover*>& runs) {
  const Device device = run_.device();
  Simulator& simulator = *worlds->simulator;
  const AgentStateView state = simulator.state();
  const auto copy = [&](const auto* field) {
    return host_copy(Span(field, static_cast<size_t>(simulator.num_slots())), device);
  };
  const std::vector<float> x_m = copy(state.x_m), y_m = copy(state.y_m), speed_mps = copy(state.speed_mps);
  const std::vector<AgentStatus> status = copy(state.status);
  const std::vector<uint8_t> halt_reason = copy(state.halt_reason);
  const std::vector<View> views = host_copy(simulator.views(), device);
  const std::vector<AgentBox> boxes = host_copy(simulator.scene().agents, device);
  const std::vector<int32_t> box_begin = host_copy(simulator.scene().world_begin, device);

  worlds->views.clear();
  std::vector<VisibilityQuery> queries;
  bool is_any_active = false;
  const bool reads_images = run_.session(policy).reads_images();
  for (size_t i = 0; i < starts.size(); ++i) {
    const TakeoverStart& start = starts[i];
    Takeover& one = *runs[i];
    const auto slot = static_cast<size_t>(worlds->first_slots[i] + start.ego);
    const auto k = static_cast<size_t>(step);
    const View& view = views[slot];
    worlds->views.push_back(view);
    if (step == 0) {
      const DrivenState& driven = start.scene->at(start.step, start.ego);
      PICTURA_CHECK(x_m[slot] == driven.position_m.x && y_m[slot] == driven.position_m.y &&
                        speed_mps[slot] == driven.speed_mps && status[slot] == driven.status,
                    "probe: scene {}, step {}: agent {} is not in its driven state",
                    start.scene->world.global_world - kFirstEvaluationWorld, start.step, start.ego);
    }
    if (one.steps < step) continue;
    if (status[slot] != AgentStatus::active) {
      one.ended_by = halt_reason[slot];
      continue;
    }
    is_any_active = true;
    one.steps = std::min(step + 1, kTakeoverSteps);
    one.speed_mps[k] = speed_mps[slot];
    one.x_m[k] = x_m[slot];
    one.y_m[k] = y_m[slot];
    if (start.user < 0) continue;

    const AgentBox user = start.scene->box_at(start.step + step, start.user);
    const LineOfSight& sight = sights_[start.scene->world.map];
    const Span<const AgentBox> its_boxes =
        Span<const AgentBox>(boxes).subspan(box_begin[i], box_begin[i + 1] - box_begin[i]);
    if (one.sight_step < 0 && !sight.is_hidden(place_camera(run_.front_camera(), view).position_m, user)) {
      one.sight_step = step;
      one.sight_distance_m = length((user.center_m - its_boxes[start.ego].center_m).xy());
    }
    if (one.input_step >= 0 || start.removed == start.user) continue;
    if (reads_images)
      queries.push_back({static_cast<int32_t>(i), box_begin[i] + start.user});
    else if (is_partner(its_boxes, start.user, start.ego, view.origin_m.xy()))
      one.input_step = step;
  }
  const std::vector<float> shares = run_.visibility(simulator.scene(), worlds->views, queries);
  for (size_t i = 0; i < shares.size(); ++i) {
    if (shares[i] > 0) runs[queries[i].view]->input_step = step;
  }
  return is_any_active;
}

std::vector<int32_t> TakeoverWorlds::decide(Worlds* worlds, size_t policy, const std::vector<TakeoverStart>& starts,
                                            int step) {
  const Device device = run_.device();
  Simulator& simulator = *worlds->simulator;
  std::vector<ObservationQuery> queries;
  for (size_t i = 0; i < starts.size(); ++i) queries.push_back({.slot = worlds->first_slots[i] + starts[i].ego});
  const auto count = static_cast<int64_t>(starts.size());
  const ObservationView rows = worlds->rows->rows(0, count);
  simulator.observe(DeviceCopy(queries, device).span(), {}, {}, rows, current_stream(device));
  const DeviceCopy views(worlds->views, device);
  DeviceArray<float> logits(starts.size() * kNumActions, device), values(starts.size(), device);
  const PolicyInput input{
      .observations = rows, .scene = &simulator.scene(), .views = views.span(), .full_chunk = takeover_pass(device)};
  run_.session(policy).evaluate(input, run_.renderer(policy), logits.span(), values.span());
  std::vector<float> log_probs = host_copy(logits.span(), device);
  host::log_softmax(log_probs.data(), count, kNumActions, log_probs.data());
  std::vector<int32_t> actions;
  for (size_t i = 0; i < starts.size(); ++i) {
    const float* const one = &log_probs[i * kNumActions];
    if (options_.worlds.argmax) {
      actions.push_back(most_likely_action(one, kNumActions));
      continue;
    }
    const ActionKey key{options_.worlds.seed, starts[i].scene->world.global_world, static_cast<uint32_t>(starts[i].ego),
                        0, static_cast<uint32_t>(starts[i].step + step)};
    actions.push_back(draw_action(one, kNumActions, key));
  }
  return actions;
}

}  // namespace pictura
