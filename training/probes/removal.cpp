#include "pictura/training/probes/removal.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <map>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/rng.h"
#include "pictura/simulator/rules/dynamics.h"
#include "pictura/training/observation.h"
#include "pictura/training/phase_timer.h"
#include "pictura/training/session.h"
#include "pictura/training/struct_copies.h"

namespace pictura {

namespace {

// The summed probability of the actions of negative longitudinal jerk.
float brake_probability(const float* logits) {
  const double largest = *std::max_element(logits, logits + kNumActions);
  double braking = 0, all = 0;
  for (int action = 0; action < kNumActions; ++action) {
    const double weight = std::exp(logits[action] - largest);
    all += weight;
    if (controls_of_action(action).jerk_long_mps3 < 0) braking += weight;
  }
  return static_cast<float>(braking / all);
}

// What is read of the driven worlds, on the host.
struct Frame {
  std::vector<uint8_t> status, agent_class;
  std::vector<float> speed_mps;
  std::vector<AgentBox> boxes;
  std::vector<LightState> lights;
  std::vector<GeometryHandle> geometry;
  std::vector<View> views;
  std::vector<int32_t> box_begin, light_begin, slot_begin;

  explicit Frame(Simulator& simulator) {
    const Device device = simulator.device();
    const AgentStateView state = simulator.state();
    const auto slots = static_cast<size_t>(simulator.num_slots());
    status = host_copy(Span<const uint8_t>(state.status, slots), device);
    agent_class = host_copy(Span<const uint8_t>(state.agent_class, slots), device);
    speed_mps = host_copy(Span<const float>(state.speed_mps, slots), device);
    const SceneBatch& scene = simulator.scene();
    boxes = host_copy_of_structs(scene.agents, device);
    lights = host_copy_of_structs(scene.light_states, device);
    geometry = host_copy(scene.geometry, device);
    views = host_copy_of_structs(simulator.views(), device);
    box_begin = host_copy(scene.world_begin, device);
    light_begin = host_copy(scene.light_begin, device);
    slot_begin = host_copy(simulator.slots().slot_begin, device);
  }

  bool is_present(size_t slot) const {
    const auto its_status = static_cast<AgentStatus>(status[slot]);
    return its_status == AgentStatus::active || its_status == AgentStatus::halted;
  }
  bool is_ego(size_t slot) const {
    return static_cast<AgentStatus>(status[slot]) == AgentStatus::active &&
           static_cast<AgentClass>(agent_class[slot]) == AgentClass::vehicle;
  }
};

// A case, and where its world and agents are in a frame.
struct DrawnCase {
  RemovalCase facts;
  size_t world = 0;
  int32_t slot = 0;  // of the ego
  int32_t user_box = 0, hidden_box = -1;
};

// States of cases as one scene, whatever worlds and steps they are of. Views with and without the user; one query each.
struct CaseScenes {
  std::vector<int32_t> world_begin{0}, light_begin{0}, hidden;
  std::vector<AgentBox> boxes;
  std::vector<GeometryHandle> geometry;
  std::vector<LightState> lights;
  std::vector<View> views, views_without;
  std::vector<VisibilityQuery> queries;

  void add_world(const Frame& frame, size_t world) {
    const auto append = [world](auto* all, const auto& some, const std::vector<int32_t>& begin) {
      all->insert(all->end(), some.begin() + begin[world], some.begin() + begin[world + 1]);
      return static_cast<int32_t>(all->size());
    };
    world_begin.push_back(append(&boxes, frame.boxes, frame.box_begin));
    light_begin.push_back(append(&lights, frame.lights, frame.light_begin));
    geometry.push_back(frame.geometry[world]);
  }
  // Of the world that was added last.
  void add_case(const Frame& frame, const DrawnCase& one) {
    const size_t world = geometry.size() - 1;
    const int32_t moved_by = world_begin[world] - frame.box_begin[one.world];
    View view = frame.views[static_cast<size_t>(one.slot)];
    view.world = static_cast<int32_t>(world);
    view.ego_agent += moved_by;
    queries.push_back({static_cast<int32_t>(views.size()), one.user_box + moved_by});
    views.push_back(view);
    view.hidden_begin = static_cast<int32_t>(hidden.size());
    if (one.hidden_box >= 0) hidden.push_back(one.hidden_box + moved_by);
    view.hidden_end = static_cast<int32_t>(hidden.size());
    views_without.push_back(view);
  }
};

// Memory for what so many agents observe, of the parts that a simulator observes.
class ObservationRows {
 public:
  ObservationRows(int64_t count, const SimulatorConfig& config) {
    for (const ObservationArray& array : kObservationArrays) {
      const auto type = array.type == ElementType::f32 ? at::kFloat : at::kInt;
      arrays_.push_back(config.observes(array.part)
                            ? at::zeros({count, array.rows * array.features},
                                        at::TensorOptions(type).device(torch_device(config.device)))
                            : at::Tensor());
    }
  }
  ObservationView rows(int64_t begin, int64_t count) const {
    ObservationView view;
    const at::Tensor* array = arrays_.data();
#define X(name, type, rows, features, part, comment)                               \
  if (array->defined()) view.name = span_of<type>(array->narrow(0, begin, count)); \
  ++array;
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
    return view;
  }

 private:
  std::vector<at::Tensor> arrays_;
};

// The worlds as policies of one kind observe them: with or without auxiliary slots. All kinds are stepped by the same
// commands, so that their states are the same bits.
struct ObservedWorlds {
  std::unique_ptr<Simulator> simulator;
  ObservationRows rows, rows_without;

  ObservedWorlds(const std::string& backend, const SimulatorConfig& config, const CompiledMaps& maps, int64_t batch)
      : simulator(make_simulator(backend, config, maps, {{0, 1, kFirstEvaluationWorld}})),
        rows(batch, config),
        rows_without(batch, config) {}
};

struct Participant {
  PolicySession* session = nullptr;
  std::unique_ptr<Renderer> renderer;  // of its images, with the maps
  ObservedWorlds* worlds = nullptr;    // that it drives in and observes
};

class RemovalProbe final : public EvaluationObserver {
 public:
  RemovalProbe(const std::vector<PolicySession*>& sessions, const RemovalOptions& options, RemovalResults* results_out)
      : options_(options), device_(sessions[0]->device()), pass_(removal_pass(device_)), results_(*results_out) {
    batch_ = (options.batch + pass_ - 1) / pass_ * pass_;
    const EvaluateOptions& worlds = options.worlds;
    SimulatorConfig config = sessions[0]->evaluation_world(worlds.steps);
    config.seed = worlds.seed;
    for (const PolicySession* session : sessions) {
      PICTURA_CHECK(session->device() == device_, "probe: expected policies on one device, got {} and {}",
                    pictura::name_of(device_), pictura::name_of(session->device()));
      const SimulatorConfig its = session->evaluation_world(worlds.steps);
      config.vector_observations |= its.vector_observations;
      config.wall_observations |= its.wall_observations;
    }
    maps_ = compile_maps_of(worlds, config);
    const Rig* rig = nullptr;
    for (PolicySession* session : sessions) {
      config.auxiliary_observations = session->evaluation_world(worlds.steps).auxiliary_observations;
      std::unique_ptr<ObservedWorlds>& observed = observed_[config.auxiliary_observations];
      if (!observed) observed = std::make_unique<ObservedWorlds>(worlds.simulator, config, maps_, batch_);
      participants_.push_back({session, session->make_renderer(), observed.get()});
      if (participants_.back().renderer) upload_maps(maps_, {}, participants_.back().renderer.get());
      if (session->reads_images() && !rig) rig = &session->rig();
    }
    RendererConfig measuring{.device = device_, .num_threads = worlds.num_threads};
    if (rig) measuring.rig = *rig;
    measuring_ = make_renderer("auto", measuring);
    upload_maps(maps_, {}, measuring_.get());
  }

  void run() {
    const auto share = static_cast<int>(participants_.size());
    for (driver_ = 0; driver_ < share && !results_.interrupted; ++driver_) drive();
    respond();
    sort_cases();
    results_.seconds = since_start_.seconds();
    if (options_.worlds.on_progress && !results_.interrupted) options_.worlds.on_progress(1, 0);
  }

  void begin(Simulator& simulator) override {
    driven_ = &simulator;
    step_ = 0;
    for_each_other([&](Simulator& other) { other.set_worlds(maps_, {}, simulator.worlds(), options_.worlds.seed); });
  }

  void before_step(Span<const Command> commands) override {
    if (step_ > 0 && step_ % options_.sample_steps == 0) sample();
    for_each_other([&](Simulator& other) { other.step(commands, current_stream(device_)); });
    ++step_;
  }

  void after_step(const StepResult& /*result*/) override {}

 private:
  template <typename F>
  void for_each_other(const F& f) {
    for (const auto& [auxiliary, observed] : observed_) {
      if (observed->simulator && observed->simulator.get() != driven_) f(*observed->simulator);
    }
  }

  // The driver's share of the scenes.
  void drive() {
    const Participant& driver = participants_[static_cast<size_t>(driver_)];
    const auto share = static_cast<int>(participants_.size());
    EvaluateOptions worlds = options_.worlds;
    worlds.densities.resize(1);
    worlds.scenarios /= share;
    worlds.first_scenario += driver_ * worlds.scenarios;
    worlds.observer = this;
    if (options_.worlds.on_progress) {
      worlds.on_progress = [this, share](double done, double) {
        const double fraction = (driver_ + done) / share, elapsed_s = since_start_.seconds();
        options_.worlds.on_progress(fraction, fraction > 0 ? elapsed_s * (1 - fraction) / fraction : 0);
      };
    }
    EvaluationWorlds shared{maps_, driver.renderer.get(), std::move(driver.worlds->simulator)};
    const EvaluateReport report = evaluate(driver.session, worlds, &shared);
    driver.worlds->simulator = std::move(shared.simulator);
    driven_ = nullptr;
    const uint64_t state = driver.worlds->simulator->state_hash(current_stream(device_));
    for_each_other([&](Simulator& other) {
      PICTURA_CHECK(other.state_hash(current_stream(device_)) == state,
                    "probe: worlds with and without auxiliary observations are in different states");
    });
    results_.interrupted = report.interrupted;
    if (driver_ == 0) results_.setting = report.results.setting;
  }

  // How many cases of a scene are wanted in all.
  int64_t wanted(int scene) const {
    const int64_t scenes = options_.worlds.scenarios, index = scene - options_.worlds.first_scenario;
    return options_.removals / scenes + (index < options_.removals % scenes);
  }

  // Draws cases of this step of all worlds.
  void sample() {
    const Frame frame(*driven_);
    const int times_left = (options_.worlds.steps - 1) / options_.sample_steps - step_ / options_.sample_steps + 1;
    std::vector<DrawnCase> drawn;
    for (size_t world = 0; world < driven_->worlds().size(); ++world) {
      const WorldSpec& spec = driven_->worlds()[world];
      const auto scene = static_cast<int>(spec.global_world - kFirstEvaluationWorld);
      int64_t& taken = taken_[scene];
      const int64_t left = wanted(scene) - taken;
      if (left == 0) continue;
      const std::vector<DrawnCase> pairs = pairs_of(frame, world);
      const auto count = std::min((left + times_left - 1) / times_left, static_cast<int64_t>(pairs.size()));
      taken += count;
      draw(frame, pairs, static_cast<int>(count), spec.global_world, &drawn);
    }
    for (size_t begin = 0; begin < drawn.size();) {
      const size_t count = std::min(static_cast<size_t>(batch_) - pending_.size(), drawn.size() - begin);
      add(frame, Span<const DrawnCase>(drawn).subspan(begin, count));
      if (pending_.size() == static_cast<size_t>(batch_)) respond();
      begin += count;
    }
  }

  // All egos of a world with each of their road users, by ego and user.
  std::vector<DrawnCase> pairs_of(const Frame& frame, size_t world) const {
    const WorldSpec& spec = driven_->worlds()[world];
    const int32_t first_slot = frame.slot_begin[world], first_box = frame.box_begin[world];
    std::vector<DrawnCase> pairs;
    for (int32_t ego = 0; ego < spec.num_agents; ++ego) {
      const auto slot = static_cast<size_t>(first_slot + ego);
      if (!frame.is_ego(slot)) continue;
      for (int32_t user = 0; user < spec.num_agents; ++user) {
        const auto user_slot = static_cast<size_t>(first_slot + user);
        if (user == ego || !frame.is_present(user_slot)) continue;
        const Vec2 apart =
            frame.boxes[static_cast<size_t>(first_box + user)].center_m.xy() - frame.views[slot].origin_m.xy();
        const float distance_m = length(apart);
        if (distance_m > options_.range_m) continue;
        RemovalCase facts;
        facts.scene = static_cast<int32_t>(spec.global_world - kFirstEvaluationWorld);
        facts.map = spec.map;
        facts.driver = driver_;
        facts.step = step_;
        facts.ego = ego;
        facts.user = user;
        facts.user_class = static_cast<AgentClass>(frame.agent_class[user_slot]);
        facts.user_halted = static_cast<AgentStatus>(frame.status[user_slot]) == AgentStatus::halted;
        facts.distance_m = distance_m;
        facts.ego_speed_mps = frame.speed_mps[slot];
        pairs.push_back({facts, world, first_slot + ego, first_box + user});
      }
    }
    return pairs;
  }

  // Some pairs of a world, none twice, and whom each hides.
  void draw(const Frame& frame, const std::vector<DrawnCase>& pairs, int count, uint32_t global_world,
            std::vector<DrawnCase>* out) const {
    std::vector<int> order(pairs.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = static_cast<int>(i);
    const auto first = static_cast<std::ptrdiff_t>(out->size());
    for (int i = 0; i < count; ++i) {
      // As rows are drawn in training, whose worlds are others.
      RandomStream random({.seed = options_.worlds.seed,
                           .world = global_world,
                           .agent = static_cast<uint32_t>(i) % RandomKey::kMaxAgents,
                           .episode = static_cast<uint32_t>(i) / RandomKey::kMaxAgents,
                           .step = static_cast<uint32_t>(step_),
                           .purpose = Purpose::minibatch});
      const auto chosen = static_cast<size_t>(i + random.below(static_cast<int>(order.size()) - i));
      std::swap(order[static_cast<size_t>(i)], order[chosen]);
      DrawnCase one = pairs[static_cast<size_t>(order[static_cast<size_t>(i)])];
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
    if (options_.control == RemovalControl::nobody) return -1;
    if (options_.control == RemovalControl::none) return one.facts.user;
    std::vector<int32_t> others;
    for (const DrawnCase& pair : pairs) {
      if (pair.slot == one.slot && pair.facts.user != one.facts.user) others.push_back(pair.facts.user);
    }
    return others.empty() ? -1 : others[static_cast<size_t>(random->below(static_cast<int>(others.size())))];
  }

  // Keeps the states of cases, and what is observed in them, for respond().
  void add(const Frame& frame, Span<const DrawnCase> cases) {
    const auto begin = static_cast<int64_t>(pending_.size()), count = static_cast<int64_t>(cases.size());
    std::vector<ObservationQuery> queries, queries_without;
    std::vector<int32_t> hidden;
    for (size_t i = 0; i < cases.size(); ++i) {
      const DrawnCase& one = cases[i];
      if (i == 0 || one.world != cases[i - 1].world) scenes_.add_world(frame, one.world);
      scenes_.add_case(frame, one);
      pending_.push_back(one.facts);
      ObservationQuery query{.slot = one.slot};
      queries.push_back(query);
      query.hidden_begin = static_cast<int32_t>(hidden.size());
      if (one.hidden_box >= 0) hidden.push_back(one.hidden_box);
      query.hidden_end = static_cast<int32_t>(hidden.size());
      queries_without.push_back(query);
    }
    const DeviceCopy<ObservationQuery> asked(queries, device_), asked_without(queries_without, device_);
    const DeviceCopy<int32_t> hidden_boxes(hidden, device_);
    const Stream stream = current_stream(device_);
    for (const auto& [auxiliary, observed] : observed_) {
      Simulator& simulator = observed->simulator ? *observed->simulator : *driven_;  // which evaluate() has
      simulator.observe(asked.span(), {}, {}, observed->rows.rows(begin, count), stream);
      simulator.observe(asked_without.span(), hidden_boxes.span(), {}, observed->rows_without.rows(begin, count),
                        stream);
    }
  }

  // Puts the pending cases to all policies.
  void respond() {
    const size_t count = pending_.size(), num_policies = participants_.size();
    if (count == 0) return;
    const DeviceCopy<int32_t> world_begin(scenes_.world_begin, device_), light_begin(scenes_.light_begin, device_),
        hidden(scenes_.hidden, device_);
    const DeviceCopy<AgentBox> boxes(scenes_.boxes, device_);
    const DeviceCopy<GeometryHandle> geometry(scenes_.geometry, device_);
    const DeviceCopy<LightState> lights(scenes_.lights, device_);
    const DeviceCopy<View> views(scenes_.views, device_), views_without(scenes_.views_without, device_);
    const DeviceCopy<VisibilityQuery> queries(scenes_.queries, device_);
    const SceneBatch scene{device_,       world_begin.span(), boxes.span(), geometry.span(), light_begin.span(),
                           lights.span(), hidden.span()};

    const at::TensorOptions floats = at::TensorOptions(at::kFloat).device(torch_device(device_));
    const auto rows = static_cast<int64_t>(count);
    const at::Tensor visible = at::empty({rows}, floats);
    measuring_->visibility(scene, views.span(), queries.span(), span_of<float>(visible), current_stream(device_));
    const std::vector<float> shares = host_copy(span_of<const float>(visible), device_);
    for (size_t i = 0; i < count; ++i) pending_[i].visible_share = shares[i];

    const size_t first = results_.responses.size();
    results_.responses.resize(first + count * num_policies);
    const at::Tensor logits = at::empty({rows, kNumActions}, floats), values = at::empty({rows}, floats);
    for (size_t policy = 0; policy < num_policies; ++policy) {
      const Participant& one = participants_[policy];
      for (const bool is_without : {false, true}) {
        const ObservationRows& observed = is_without ? one.worlds->rows_without : one.worlds->rows;
        const PolicyInput input{.observations = observed.rows(0, rows),
                                .scene = &scene,
                                .views = is_without ? views_without.span() : views.span(),
                                .full_chunk = pass_};
        one.session->evaluate(input, one.renderer.get(), span_of<float>(logits), span_of<float>(values));
        const std::vector<float> its_logits = host_copy(span_of<const float>(logits), device_),
                                 its_values = host_copy(span_of<const float>(values), device_);
        for (size_t i = 0; i < count; ++i) {
          RemovalResponse& response = results_.responses[first + i * num_policies + policy];
          (is_without ? response.value_without : response.value) = its_values[i];
          (is_without ? response.brake_without : response.brake) = brake_probability(&its_logits[i * kNumActions]);
        }
      }
    }
    results_.cases.insert(results_.cases.end(), pending_.begin(), pending_.end());
    pending_.clear();
    scenes_ = {};
  }

  // By scene, step, ego and user, in whatever order they came.
  void sort_cases() {
    const size_t num_policies = participants_.size();
    std::vector<size_t> order(results_.cases.size());
    for (size_t i = 0; i < order.size(); ++i) order[i] = i;
    const auto key = [this](size_t i) {
      const RemovalCase& one = results_.cases[i];
      return std::tuple(one.scene, one.step, one.ego, one.user);
    };
    std::sort(order.begin(), order.end(), [&key](size_t a, size_t b) { return key(a) < key(b); });
    std::vector<RemovalCase> cases;
    std::vector<RemovalResponse> responses;
    for (const size_t i : order) {
      cases.push_back(results_.cases[i]);
      for (size_t policy = 0; policy < num_policies; ++policy) responses.push_back(results_.response(i, policy));
    }
    results_.cases = std::move(cases);
    results_.responses = std::move(responses);
  }

  const RemovalOptions& options_;
  const Device device_;
  const int pass_;
  int64_t batch_ = 0;
  const Stopwatch since_start_;
  CompiledMaps maps_;
  std::map<bool, std::unique_ptr<ObservedWorlds>> observed_;  // by whether auxiliary slots are filled
  std::vector<Participant> participants_;
  std::unique_ptr<Renderer> measuring_;
  Simulator* driven_ = nullptr;
  int driver_ = 0, step_ = 0;
  std::map<int, int64_t> taken_;  // cases of each scene
  std::vector<RemovalCase> pending_;
  CaseScenes scenes_;
  RemovalResults& results_;
};

void check(const RemovalOptions& options, size_t num_policies) {
  const int scenes = options.worlds.scenarios, steps = options.worlds.steps;
  if (num_policies == 0) fail_usage("probe: expected one policy or more");
  if (scenes < 1 || scenes % static_cast<int>(num_policies) != 0) {
    fail_usage("probe: expected a number of scenes that {} policies can drive equal shares of, got {}", num_policies,
               scenes);
  }
  if (options.removals < 1) fail_usage("probe: expected one removal or more, got {}", options.removals);
  if (options.sample_steps < 1 || options.sample_steps >= steps) {
    fail_usage("probe: expected a sample every 1 to {} steps, got {}", steps - 1, options.sample_steps);
  }
  if (!(options.range_m > 0)) fail_usage("probe: expected a range above 0 m, got {}", options.range_m);
  if (options.batch < 1) fail_usage("probe: expected one case a call or more, got {}", options.batch);
  if (options.worlds.densities.empty() && options.worlds.agents_per_world <= 0) {
    fail_usage("probe: expected a density, or a number of agents a world");
  }
}

// What the figure calls a policy: its file, or its run, whose files have the same names in all runs.
std::string short_name(const std::string& path) {
  const std::filesystem::path absolute = std::filesystem::absolute(path);
  const std::string stem = absolute.stem().string();
  return stem == "checkpoint" || stem == "policy" ? absolute.parent_path().filename().string() : stem;
}

// Paths where short names are equal, and numbered where even these are.
std::vector<std::string> names_of(const std::vector<std::string>& paths) {
  std::vector<std::string> names;
  for (const std::string& path : paths) names.push_back(short_name(path));
  const auto has_twin = [](const std::vector<std::string>& all, size_t i) {
    return std::count(all.begin(), all.end(), all[i]) > 1;
  };
  const std::vector<std::string> short_names = names;
  for (size_t i = 0; i < names.size(); ++i) {
    if (has_twin(short_names, i)) names[i] = paths[i];
  }
  for (size_t i = 0; i < names.size(); ++i) {
    if (has_twin(paths, i))
      names[i] +=
          fmt::format(" ({})", std::count(paths.begin(), paths.begin() + static_cast<std::ptrdiff_t>(i) + 1, paths[i]));
  }
  return names;
}

}  // namespace

int default_removal_scenes(size_t num_policies, size_t num_maps) {
  const auto for_each = static_cast<int>(num_policies * num_maps);
  return num_policies == 1 ? 2 * for_each : for_each;
}

RemovalResults probe_removal(const RemovalOptions& options) {
  check(options, options.policies.size());
  std::vector<std::unique_ptr<PolicySession>> opened;
  std::vector<PolicySession*> sessions;
  for (const std::string& path : options.policies) {
    opened.push_back(std::make_unique<PolicySession>(path, session_options(options.worlds)));
    sessions.push_back(opened.back().get());
  }
  return probe_removal(sessions, options);
}

RemovalResults probe_removal(const std::vector<PolicySession*>& sessions, const RemovalOptions& options) {
  check(options, sessions.size());
  PICTURA_CHECK(options.policies.size() == sessions.size(), "probe: expected {} names of policies, got {}",
                sessions.size(), options.policies.size());
  const EvaluateOptions& worlds = options.worlds;
  RemovalResults results;
  results.agents_per_world = worlds.agents_per_world;
  results.density = "custom";
  if (worlds.agents_per_world == 0) {
    const auto density = static_cast<size_t>(worlds.densities[0]);
    results.density = kDensityNames[density];
    results.agents_per_world = kDensityAgents[density];
  }
  results.first_scene = worlds.first_scenario;
  results.scenes = worlds.scenarios;
  results.removals_asked = options.removals;
  results.sample_steps = options.sample_steps;
  results.range_m = options.range_m;
  results.control = options.control;
  const std::vector<std::string> names = names_of(options.policies);
  for (size_t i = 0; i < sessions.size(); ++i) {
    results.policies.push_back(
        {names[i], options.policies[i], sessions[i]->evaluation_setting().policy_hash, sessions[i]->reads_images()});
  }
  RemovalProbe(sessions, options, &results).run();
  return results;
}

}  // namespace pictura
