#include "pictura/evaluation/probes/probe_run.h"

#include <algorithm>
#include <cmath>
#include <filesystem>
#include <limits>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/make_simulator.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/raster/check.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/evaluation/probes/observation_rows.h"
#include "pictura/simulator/rules/dynamics.h"

namespace pictura {

namespace {

// Returns the sum of the probabilities of actions with negative longitudinal jerk.
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

// Scene in the memory of a device.
class SceneOnDevice {
 public:
  SceneOnDevice(const KeptScene& scene, Device device)
      : world_begin_(scene.world_begin, device),
        light_begin_(scene.light_begin, device),
        hidden_(scene.hidden, device),
        boxes_(scene.boxes, device),
        geometry_(scene.geometry, device),
        lights_(scene.lights, device),
        scene_{device,         world_begin_.span(), boxes_.span(), geometry_.span(), light_begin_.span(),
               lights_.span(), hidden_.span()} {}
  const SceneBatch& scene() const { return scene_; }

 private:
  DeviceCopy<int32_t> world_begin_, light_begin_, hidden_;
  DeviceCopy<AgentBox> boxes_;
  DeviceCopy<GeometryHandle> geometry_;
  DeviceCopy<LightState> lights_;
  SceneBatch scene_;
};

// Returns the name of a policy in figures: the name of its file, or the name of its run if it is a checkpoint, because
// checkpoint files have the same names in all runs.
std::string short_name(const std::string& path) {
  const std::filesystem::path absolute = std::filesystem::absolute(path);
  const std::string stem = absolute.stem().string();
  return stem == "checkpoint" || stem == "policy" ? absolute.parent_path().filename().string() : stem;
}

// Returns short names of policies. Policies with equal short names get their paths as names; those with equal paths get
// numbered paths.
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

int default_probe_scenes(size_t num_policies, size_t num_maps) {
  const auto for_each = static_cast<int>(num_policies * num_maps);
  return num_policies == 1 ? 2 * for_each : for_each;
}

void check_probe(const ProbeOptions& options, size_t num_policies) {
  const int scenes = options.worlds.scenarios, steps = options.worlds.steps;
  if (num_policies == 0) fail_usage("probe: expected one policy or more");
  if (scenes < 1 || scenes % static_cast<int>(num_policies) != 0) {
    fail_usage("probe: expected a number of scenes divisible among {} policies, got {}", num_policies, scenes);
  }
  if (options.sample_steps < 1 || options.sample_steps >= steps) {
    fail_usage("probe: expected a sample every 1 to {} steps, got {}", steps - 1, options.sample_steps);
  }
  if (options.batch < 1) fail_usage("probe: expected one case per call or more, got {}", options.batch);
  if (options.worlds.densities.empty() && options.worlds.agents_per_world <= 0) {
    fail_usage("probe: expected a density, or a number of agents per world");
  }
}

std::unique_ptr<PolicySession> open_policy(const ProbeOptions& options, size_t policy) {
  const auto& own = options.make_own_policies;
  if (policy < own.size() && own[policy]) return own[policy](options.worlds);
  return std::make_unique<PolicySession>(options.policies[policy], options.worlds);
}

ProbeFrame::ProbeFrame(Simulator& simulator, int steps_done, int drives)
    : worlds(simulator.worlds()), step(steps_done), driver(drives) {
  const Device device = simulator.device();
  const AgentStateView state = simulator.state();
  const auto slots = static_cast<size_t>(simulator.num_slots());
  status = host_copy(Span<const AgentStatus>(state.status, slots), device);
  agent_class = host_copy(Span<const AgentClass>(state.agent_class, slots), device);
  lane = host_copy(Span<const int32_t>(state.lane, slots), device);
  speed_mps = host_copy(Span<const float>(state.speed_mps, slots), device);
  const SceneBatch& scene = simulator.scene();
  boxes = host_copy(scene.agents, device);
  lights = host_copy(scene.light_states, device);
  geometry = host_copy(scene.geometry, device);
  views = host_copy(simulator.views(), device);
  box_begin = host_copy(scene.world_begin, device);
  light_begin = host_copy(scene.light_begin, device);
  slot_begin = host_copy(simulator.slots().slot_begin, device);
}

void KeptScene::add_world(const ProbeFrame& frame, size_t world, Span<const InsertedBox> inserted) {
  const auto append = [world](auto* all, const auto& some, const std::vector<int32_t>& begin) {
    all->insert(all->end(), some.begin() + begin[world], some.begin() + begin[world + 1]);
  };
  append(&boxes, frame.boxes, frame.box_begin);
  for (const InsertedBox& one : inserted) boxes.push_back(one.box);
  world_begin.push_back(static_cast<int32_t>(boxes.size()));
  append(&lights, frame.lights, frame.light_begin);
  light_begin.push_back(static_cast<int32_t>(lights.size()));
  geometry.push_back(frame.geometry[world]);
}

View KeptScene::view_of(const ProbeFrame& frame, size_t world, int32_t slot, const std::vector<int32_t>& without) {
  View view = frame.views[slot];
  view.world = static_cast<int32_t>(geometry.size()) - 1;
  view.ego_agent = box_of(frame, world, view.ego_agent);
  view.hidden_begin = static_cast<int32_t>(hidden.size());
  hidden.insert(hidden.end(), without.begin(), without.end());
  view.hidden_end = static_cast<int32_t>(hidden.size());
  return view;
}

int64_t CaseQuota::due(int32_t scene, int step) const {
  const int64_t scenes = options_.worlds.scenarios, index = scene - options_.worlds.first_scenario;
  const int64_t wanted = cases_ / scenes + (index < cases_ % scenes);
  const auto found = taken_.find(scene);
  const int64_t left = wanted - (found == taken_.end() ? 0 : found->second);
  const int64_t times_left = (options_.worlds.steps - 1) / options_.sample_steps - step / options_.sample_steps + 1;
  return (left + times_left - 1) / times_left;
}

// Worlds with the observations of one kind of policies: those with auxiliary slots, or those without. The same commands
// step the worlds of both kinds, so that their states are bit-identical.
struct ProbeRun::ObservedWorlds {
  const SimulatorConfig config;
  std::unique_ptr<Simulator> simulator;
  ObservationRows rows, rows_without;

  ObservedWorlds(const std::string& backend, const SimulatorConfig& its_config, const CompiledMaps& maps, int64_t batch)
      : config(its_config),
        simulator(make_simulator(backend, config, maps, {{0, 1, kFirstEvaluationWorld}})),
        rows(batch, config),
        rows_without(batch, config) {}
};

struct ProbeRun::Participant {
  PolicySession* session = nullptr;          // drives
  std::unique_ptr<PolicySession> untrained;  // responds instead of `session`
  std::unique_ptr<Renderer> renderer;        // renderer of the session's images, with the maps
  ObservedWorlds* worlds = nullptr;          // worlds in which the policy drives and which it observes

  PolicySession& answering() const { return untrained ? *untrained : *session; }
};

// Pairs whose states and observations are kept until there are enough for one call.
struct ProbeRun::Pending {
  KeptScene scene;
  std::vector<View> views, views_without;
  std::vector<VisibilityQuery> queries;
  std::vector<size_t> asked;  // indices of the pairs to which `queries` belong
};

ProbeRun::ProbeRun(const std::vector<PolicySession*>& sessions, const ProbeOptions& options, ProbeResults* results_out,
                   const ProbeKind& kind)
    : options_(options),
      device_(sessions[0]->device()),
      pass_(probe_pass(device_)),
      pending_(std::make_unique<Pending>()),
      results_(*results_out) {
  PICTURA_CHECK(options.policies.size() == sessions.size(), "probe: expected {} names of policies, got {}",
                sessions.size(), options.policies.size());
  batch_ = (options.batch + pass_ - 1) / pass_ * pass_;
  const EvaluateOptions& worlds = options.worlds;
  SimulatorConfig config = sessions[0]->evaluation_world(worlds.steps);
  config.seed = worlds.seed;
  config.walls |= worlds.adds_walls;
  for (const PolicySession* session : sessions) {
    PICTURA_CHECK(session->device() == device_, "probe: expected policies on one device, got {} and {}",
                  pictura::name_of(device_), pictura::name_of(session->device()));
    const SimulatorConfig its = session->evaluation_world(worlds.steps);
    config.vector_observations |= its.vector_observations;
    config.wall_observations |= its.wall_observations;
  }
  maps_ = compile_maps_of(worlds, config);
  bool has_cameras = false;
  for (PolicySession* session : sessions) {
    config.auxiliary_observations = session->evaluation_world(worlds.steps).auxiliary_observations;
    std::unique_ptr<ObservedWorlds>& observed = observed_[config.auxiliary_observations];
    if (!observed) observed = std::make_unique<ObservedWorlds>(worlds.simulator, config, maps_, batch_);
    participants_.push_back({session, kind.untrained ? session->make_untrained(worlds.seed) : nullptr,
                             session->make_renderer(), observed.get()});
    if (participants_.back().renderer) upload_maps(maps_, {}, participants_.back().renderer.get());
    if (session->reads_images() && !has_cameras) cameras_ = session->renderer_config();
    has_cameras |= session->reads_images();
  }
  front_camera_ = pinhole_cameras(cameras_.rig)[0];
  measuring_ = make_renderer("auto", {.rig = cameras_.rig, .device = device_, .num_threads = worlds.num_threads});
  upload_maps(maps_, {}, measuring_.get());

  results_.agents_per_world = worlds.agents_per_world;
  results_.density = "custom";
  if (worlds.agents_per_world == 0) {
    const auto density = static_cast<size_t>(worlds.densities[0]);
    results_.density = kDensityNames[density];
    results_.agents_per_world = kDensityAgents[density];
  }
  results_.first_scene = worlds.first_scenario;
  results_.scenes = worlds.scenarios;
  results_.sample_steps = options.sample_steps;
  results_.controller = worlds.controller;
  const std::vector<std::string> names = names_of(options.policies);
  for (size_t i = 0; i < sessions.size(); ++i) {
    const PolicySession* const untrained = participants_[i].untrained.get();
    results_.policies.push_back({names[i], options.policies[i], sessions[i]->policy_hash(), sessions[i]->reads_images(),
                                 untrained ? untrained->policy_hash() : ""});
  }
}

ProbeRun::~ProbeRun() = default;

PolicySession& ProbeRun::session(size_t policy) const { return participants_[policy].answering(); }
Renderer* ProbeRun::renderer(size_t policy) const { return participants_[policy].renderer.get(); }

SimulatorConfig ProbeRun::world_of(size_t policy) const {
  SimulatorConfig config = participants_[policy].worlds->config;
  const SimulatorConfig its = participants_[policy].session->evaluation_world(options_.worlds.steps);
  config.vector_observations = its.vector_observations;
  config.wall_observations = its.wall_observations;
  return config;
}

std::vector<float> ProbeRun::run(const std::function<void(const ProbeFrame&)>& sample, const Watch& watch) {
  sample_ = sample;
  watch_ = watch;
  const auto num_policies = static_cast<int>(participants_.size());
  if (options_.worlds.controller.empty()) {
    for (driver_ = 0; driver_ < num_policies && !results_.interrupted; ++driver_) drive();
  } else {
    drive_by_controller();
  }
  evaluate_pending();
  results_.seconds = since_start_.seconds();
  if (options_.worlds.on_progress && !results_.interrupted) options_.worlds.on_progress(1, 0);
  return std::move(visible_shares_);
}

void ProbeRun::begin(Simulator& simulator) {
  driven_ = &simulator;
  step_ = 0;
  for_each_other([&](Simulator& other) { other.set_worlds(maps_, {}, simulator.worlds(), options_.worlds.seed); });
}

void ProbeRun::before_step(Span<const Command> commands) {
  const int driver = options_.worlds.controller.empty() ? driver_ : static_cast<int>(participants_.size());
  if (watch_) watch_(*driven_, driver);
  if (step_ > 0 && step_ % options_.sample_steps == 0) sample_(ProbeFrame(*driven_, step_, driver));
  for_each_other([&](Simulator& other) { other.step(commands, current_stream(device_)); });
  ++step_;
}

template <typename F>
void ProbeRun::for_each_other(const F& f) {
  if (watch_) return;
  for (const auto& [auxiliary, observed] : observed_) {
    if (observed->simulator && observed->simulator.get() != driven_) f(*observed->simulator);
  }
}

// Returns the options of the worlds that the current driver drives. They are one of `shares` equal shares.
EvaluateOptions ProbeRun::share_of_driver(int shares) {
  EvaluateOptions worlds = options_.worlds;
  worlds.densities.resize(1);
  worlds.scenarios /= shares;
  worlds.first_scenario += driver_ * worlds.scenarios;
  worlds.observer = this;
  if (options_.worlds.on_progress) {
    worlds.on_progress = [this, shares](double done, double) {
      const double fraction = (driver_ + done) / shares, elapsed_s = since_start_.seconds();
      options_.worlds.on_progress(fraction, fraction > 0 ? elapsed_s * (1 - fraction) / fraction : 0);
    };
  }
  return worlds;
}

// Lets the current driver drive its share of the scenes.
void ProbeRun::drive() {
  const Participant& driver = participants_[driver_];
  EvaluationWorlds shared{maps_, driver.renderer.get(), std::move(driver.worlds->simulator)};
  const EvaluateReport report =
      evaluate(driver.session, share_of_driver(static_cast<int>(participants_.size())), &shared);
  driver.worlds->simulator = std::move(shared.simulator);
  driven_ = nullptr;
  const uint64_t state = driver.worlds->simulator->state_hash(current_stream(device_));
  for_each_other([&](Simulator& other) {
    PICTURA_CHECK(other.state_hash(current_stream(device_)) == state,
                  "probe: worlds with and without auxiliary observations have different states");
  });
  results_.interrupted = report.interrupted;
  if (driver_ == 0) results_.setting = report.results.setting;
}

// Lets a controller drive all scenes. The controller reads no observations. The setting in the results is that of the
// policies.
void ProbeRun::drive_by_controller() {
  EvaluateOptions worlds = share_of_driver(1);
  worlds.device = device_.is_host() ? "cpu" : "cuda";
  std::unique_ptr<Simulator>& simulator = participants_[0].worlds->simulator;
  if (watch_) {
    SimulatorConfig config = simulator->config();
    config.vector_observations = false;
    simulator = make_simulator(worlds.simulator, config, maps_, simulator->worlds());
  }
  EvaluationWorlds shared{maps_, nullptr, std::move(simulator)};
  const EvaluateReport report = evaluate(worlds, &shared);
  simulator = std::move(shared.simulator);
  driven_ = nullptr;
  results_.interrupted = report.interrupted;
  const EvaluationSetting& driven = report.results.setting;
  results_.setting = setting_of(*participants_[0].session);
  results_.setting.maps = driven.maps;
  results_.setting.steps = driven.steps;
  results_.setting.argmax = driven.argmax;
  results_.setting.seed = driven.seed;
  results_.setting.light_heads = driven.light_heads;
}

void ProbeRun::add_pairs(const ProbeFrame& frame, Span<const ProbePair> pairs) {
  for (size_t begin = 0; begin < pairs.size();) {
    const size_t count = std::min(static_cast<size_t>(batch_) - pending_->views.size(), pairs.size() - begin);
    add(frame, pairs.subspan(begin, count));
    if (pending_->views.size() == static_cast<size_t>(batch_)) evaluate_pending();
    begin += count;
  }
}

// Keeps the states of pairs, and their observations, for evaluate_pending().
void ProbeRun::add(const ProbeFrame& frame, Span<const ProbePair> pairs) {
  KeptScene& scene = pending_->scene;
  const auto begin = static_cast<int64_t>(pending_->views.size()), count = static_cast<int64_t>(pairs.size());
  std::vector<ObservationQuery> queries, queries_without;
  std::vector<int32_t> hidden;
  std::vector<InsertedBox> inserted;
  for (size_t first = 0, end = 0; first < pairs.size(); first = end) {
    // Handles the pairs of one world. The kept world contains the inserted boxes of all these pairs; the views of a
    // pair hide the boxes of the other pairs.
    const size_t world = pairs[first].world;
    std::vector<InsertedBox> its_inserted;
    for (end = first; end < pairs.size() && pairs[end].world == world; ++end) {
      if (pairs[end].inserted) its_inserted.push_back(*pairs[end].inserted);
    }
    scene.add_world(frame, world, its_inserted);
    std::vector<int32_t> others(its_inserted.size());
    for (size_t i = 0; i < others.size(); ++i) others[i] = scene.first_inserted(frame, world) + static_cast<int32_t>(i);
    auto next = others.begin();
    for (size_t i = first; i < end; ++i) {
      const ProbePair& pair = pairs[i];
      std::vector<int32_t> shown = others, without = others;
      if (pair.inserted) shown.erase(shown.begin() + (next++ - others.begin()));
      if (pair.hidden_box >= 0) without.push_back(scene.box_of(frame, world, pair.hidden_box));
      if (pair.measured_box >= 0) {
        pending_->queries.push_back(
            {static_cast<int32_t>(pending_->views.size()), scene.box_of(frame, world, pair.measured_box)});
        pending_->asked.push_back(pending_->views.size());
      }
      pending_->views.push_back(scene.view_of(frame, world, pair.slot, shown));
      pending_->views_without.push_back(scene.view_of(frame, world, pair.slot, without));

      ObservationQuery query{.slot = pair.slot};
      query.inserted_begin = static_cast<int32_t>(inserted.size());
      if (pair.inserted) inserted.push_back(*pair.inserted);
      query.inserted_end = static_cast<int32_t>(inserted.size());
      queries.push_back(query);
      query.inserted_begin = query.inserted_end = 0;
      query.hidden_begin = static_cast<int32_t>(hidden.size());
      if (pair.hidden_box >= 0) hidden.push_back(pair.hidden_box);
      query.hidden_end = static_cast<int32_t>(hidden.size());
      queries_without.push_back(query);
    }
  }
  const DeviceCopy<ObservationQuery> asked(queries, device_), asked_without(queries_without, device_);
  const DeviceCopy<int32_t> hidden_boxes(hidden, device_);
  const DeviceCopy<InsertedBox> inserted_boxes(inserted, device_);
  const Stream stream = current_stream(device_);
  for (const auto& [auxiliary, observed] : observed_) {
    // evaluate() owns the simulator that drives.
    Simulator& simulator = observed->simulator ? *observed->simulator : *driven_;
    simulator.observe(asked.span(), {}, inserted_boxes.span(), observed->rows.rows(begin, count), stream);
    simulator.observe(asked_without.span(), hidden_boxes.span(), {}, observed->rows_without.rows(begin, count), stream);
  }
}

std::vector<float> ProbeRun::visibility(const KeptScene& scene, const std::vector<View>& views,
                                        const std::vector<VisibilityQuery>& queries) {
  return visibility(SceneOnDevice(scene, device_).scene(), views, queries);
}

std::vector<float> ProbeRun::visibility(const SceneBatch& scene, const std::vector<View>& views,
                                        const std::vector<VisibilityQuery>& queries) {
  if (queries.empty()) return {};
  const DeviceCopy<View> its_views(views, device_);
  const DeviceCopy<VisibilityQuery> its_queries(queries, device_);
  DeviceArray<float> visible(queries.size(), device_);
  measuring_->visibility(scene, its_views.span(), its_queries.span(), visible.span(), current_stream(device_));
  return host_copy(visible.span(), device_);
}

// Evaluates the pending pairs with all policies.
void ProbeRun::evaluate_pending() {
  const size_t count = pending_->views.size(), num_policies = participants_.size();
  if (count == 0) return;
  const size_t first_share = visible_shares_.size();
  visible_shares_.resize(first_share + count, std::numeric_limits<float>::quiet_NaN());
  const std::vector<float> shares = visibility(pending_->scene, pending_->views, pending_->queries);
  for (size_t i = 0; i < shares.size(); ++i) visible_shares_[first_share + pending_->asked[i]] = shares[i];

  const SceneOnDevice on_device(pending_->scene, device_);
  const DeviceCopy<View> views(pending_->views, device_), views_without(pending_->views_without, device_);
  const auto rows = static_cast<int64_t>(count);
  const size_t first = results_.responses.size();
  results_.responses.resize(first + count * num_policies);
  DeviceArray<float> logits(count * kNumActions, device_), values(count, device_);
  for (size_t policy = 0; policy < num_policies; ++policy) {
    const Participant& one = participants_[policy];
    for (const bool is_without : {false, true}) {
      const ObservationRows& observed = is_without ? one.worlds->rows_without : one.worlds->rows;
      const PolicyInput input{.observations = observed.rows(0, rows),
                              .scene = &on_device.scene(),
                              .views = is_without ? views_without.span() : views.span(),
                              .full_chunk = pass_};
      one.answering().evaluate(input, one.renderer.get(), logits.span(), values.span());
      const std::vector<float> its_logits = host_copy(logits.span(), device_),
                               its_values = host_copy(values.span(), device_);
      for (size_t i = 0; i < count; ++i) {
        PairedResponse& response = results_.responses[first + i * num_policies + policy];
        (is_without ? response.value_without : response.value) = its_values[i];
        (is_without ? response.brake_without : response.brake) = brake_probability(&its_logits[i * kNumActions]);
      }
    }
  }
  *pending_ = {};
}

}  // namespace pictura
