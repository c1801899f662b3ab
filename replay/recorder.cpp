#include "pictura/replay/recorder.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "pictura/backends/make_renderer.h"
#include "pictura/backends/upload_maps.h"
#include "pictura/common/error.h"
#include "pictura/common/support/messages.h"
#include "pictura/replay/images.h"
#include "pictura/replay/map_shapes.h"
#include "pictura/replay/units.h"
#include "pictura/simulator/rules/episode.h"
#include "pictura/simulator/simulator_setup.h"

namespace pictura {

namespace {

constexpr int32_t kTurn_ddeg = 3600;

/// Adds whole turns to a heading, so that it differs from the previous heading by at most half a turn.
int32_t near_heading(int32_t heading_ddeg, int32_t before_ddeg) {
  const int32_t apart = heading_ddeg - before_ddeg;
  const auto turns = static_cast<int32_t>(std::lround(static_cast<double>(apart) / kTurn_ddeg));
  return heading_ddeg - turns * kTurn_ddeg;
}

int32_t heading_of(const AgentBox& box) { return tenths_of_degree(std::atan2(box.sin_heading, box.cos_heading)); }
ReplayBody body_of(const AgentBox& box) {
  return {box.agent_class, centimetres(box.length_m), centimetres(box.width_m), centimetres(box.height_m)};
}

/// A life (the time from an agent's entry to its exit) that began in the middle of an episode.
struct LaterLife {
  size_t episode = 0;           // index among the replay's episodes
  int32_t slot = 0, agent = 0;  // agent: index in the finished replay
  ReplayBody body;
  std::vector<float> conditioning;
};

/// Sets the body and the conditioning of an episode's agent to those of a life.
void set_agent(const LaterLife& life, int32_t agent, ReplayEpisode* episode_inout) {
  episode_inout->agents[agent] = life.body;
  std::copy(life.conditioning.begin(), life.conditioning.end(),
            episode_inout->conditioning.begin() + int64_t{agent} * kNumConditioning);
}

/// Turns each later life into a separate agent. agent_of: [frames, slots] index of each slot's agent, below num_agents.
void split_lives(const std::vector<LaterLife>& lives, const std::vector<int32_t>& agent_of, int32_t num_agents,
                 Replay* replay_inout) {
  if (lives.empty()) return;
  Replay& replay = *replay_inout;
  const int32_t num_slots = replay.num_agents;
  const auto at = [num_slots](int32_t frame, int32_t slot) {
    return static_cast<size_t>(frame) * static_cast<size_t>(num_slots) + static_cast<size_t>(slot);
  };
  const auto frames = static_cast<size_t>(replay.num_frames), agents = static_cast<size_t>(num_agents);
  for (size_t which = 0; which < kNumTracks; ++which) {
    const bool is_status = static_cast<Track>(which) == Track::status;
    std::vector<int32_t> track(frames * agents, is_status ? static_cast<int32_t>(AgentStatus::absent) : 0);
    for (int32_t frame = 0; frame < replay.num_frames; ++frame) {
      for (int32_t slot = 0; slot < num_slots; ++slot) {
        const size_t from = at(frame, slot);
        track[static_cast<size_t>(frame) * agents + static_cast<size_t>(agent_of[from])] = replay.tracks[which][from];
      }
    }
    replay.tracks[which] = std::move(track);
  }
  for (ReplayEpisode& episode : replay.episodes) {
    episode.agents.resize(agents);
    episode.conditioning.resize(agents * kNumConditioning);
    for (ReplayChain& chain : episode.chains) chain.agent = agent_of[at(chain.frame, chain.agent)];
  }
  for (const LaterLife& life : lives) set_agent(life, life.agent, &replay.episodes[life.episode]);
  for (int32_t frame = 0; frame < replay.num_frames && replay.followed >= 0; ++frame) {
    replay.followed_agents.push_back(agent_of[at(frame, replay.followed)]);
  }
  auto& first = replay.first_infraction;
  if (first.frame >= 0) first.agent = agent_of[at(first.frame, first.agent)];
  replay.num_agents = num_agents;
}

int64_t max_frames(int num_agents, int64_t max_numbers) {
  return max_numbers / (std::max(1, num_agents) * int64_t{kNumTracks});
}

}  // namespace

ReplayBox replay_box(const AgentBox& box) {
  return {body_of(box), centimetres(box.center_m.x), centimetres(box.center_m.y), centimetres(box.center_m.z),
          heading_of(box)};
}

ReplayDecision decision_of(Span<const float> logits, float value) {
  PICTURA_CHECK(logits.size() == kNumActions, "replay: expected {} logits, got {}", kNumActions, logits.size());
  ReplayDecision decision{.value = value};
  const float highest = *std::max_element(logits.begin(), logits.end());
  double sum = 0;
  for (size_t i = 0; i < kNumActions; ++i) sum += std::exp(static_cast<double>(logits[i] - highest));
  for (size_t i = 0; i < kNumActions; ++i) {
    decision.probabilities[i] = static_cast<float>(std::exp(static_cast<double>(logits[i] - highest)) / sum);
  }
  return decision;
}

std::vector<ReplayCamera> replay_cameras(const Rig& rig) {
  std::vector<ReplayCamera> cameras;
  for (const Camera& camera : rig.cameras) {
    const Vec3 at = camera.position_m;
    cameras.push_back({camera.name, camera.width_px, camera.height_px, camera.focal_x_px, camera.focal_y_px,
                       camera.center_x_px, camera.center_y_px, at.x, at.y, at.z, camera.yaw_rad, camera.pitch_rad,
                       camera.roll_rad});
  }
  return cameras;
}

AgentCameras::AgentCameras(Simulator& simulator, RendererConfig config) : simulator_(simulator) {
  config.device = {};   // the CPU renderer draws on the host
  config.samples = {};  // default samples: exact coverage
  renderer_ = make_renderer("cpu", config);
  upload_maps(simulator, renderer_.get());
  images_ = std::make_unique<HostImages>(renderer_->config().rig, 1);
}

AgentCameras::~AgentCameras() = default;

std::string AgentCameras::draw(int slot) {
  renderer_->render(simulator_.scene(), simulator_.views().subspan(slot, 1), images_->batch());
  std::string bytes;
  for (size_t camera = 0; camera < renderer_->config().rig.cameras.size(); ++camera) {
    const std::vector<uint8_t> rgb = images_->interleaved(0, static_cast<int>(camera));
    bytes.append(reinterpret_cast<const char*>(rgb.data()), rgb.size());
  }
  return bytes;
}

struct Recorder::Parts {
  Parts(Simulator& its_simulator, const RecorderOptions& options)
      : simulator(its_simulator),
        world(options.world),
        max_numbers(options.max_numbers),
        setup(simulator.config(), simulator.maps(), simulator.handles(), simulator.worlds()) {
    take_seed();
    first_slot = setup.slot_begin[world];
    first_box = setup.box_begin[world];
    num_boxes = setup.box_begin[static_cast<size_t>(world) + 1] - first_box;
    first_light = setup.light_begin[world];
    replay.num_agents = setup.slot_begin[static_cast<size_t>(world) + 1] - first_slot;
    max_agents = replay.num_agents;
    replay.num_lights = setup.light_begin[static_cast<size_t>(world) + 1] - first_light;
    replay.followed = options.followed;
    replay.map = map_shapes(setup.map_of(world));
    replay.scenery = map_scenery(setup.map_of(world).geometry);
    replay.cameras = replay_cameras(options.cameras.rig);
    replay.line_floor_px = options.cameras.line_floor_px;
    if (!options.keeps_images || options.followed < 0) return;
    cameras = std::make_unique<AgentCameras>(simulator, options.cameras);
    replay.images.frames_per_group = kReplayFramesPerGroup;
  }

  // Updates the seed of the world's random numbers, because resets change the seed.
  void take_seed() { replay.origin.seed = simulator.arrays().seed[world]; }
  size_t slot(int32_t agent) const { return static_cast<size_t>(first_slot + agent); }
  std::vector<int32_t>& track(Track which) { return replay.tracks[static_cast<size_t>(which)]; }
  ReplayEpisode& episode() { return replay.episodes.back(); }
  bool is_absent(const AgentStateView& state, int32_t agent) const { return !has_body(state.status[slot(agent)]); }

  void begin_episode(const AgentStateView& state, Span<const AgentBox> boxes) {
    ReplayEpisode next;
    next.index = simulator.episode_index()[world];
    next.first_frame = replay.num_frames;
    for (int32_t agent = 0; agent < replay.num_agents; ++agent) {
      next.agents.push_back(body_of(boxes[agent]));
      const float* conditioning = state.conditioning + slot(agent) * kNumConditioning;
      next.conditioning.insert(next.conditioning.end(), conditioning, conditioning + kNumConditioning);
      replay.metrics.spawned += !is_absent(state, agent);
    }
    for (size_t i = static_cast<size_t>(replay.num_agents); i < boxes.size(); ++i) {
      if (!boxes[i].drawn) continue;
      next.parked.push_back(replay_box(boxes[i]));
    }
    replay.episodes.push_back(std::move(next));
    chains.assign(replay.num_agents, -1);
    lives.assign(state.life + slot(0), state.life + slot(replay.num_agents));
    reset_agents();
  }

  // Makes each slot's agent the agent of the slot's number.
  void reset_agents() {
    agents.resize(replay.num_agents);
    std::iota(agents.begin(), agents.end(), 0);
    next_agent = replay.num_agents;
  }

  void begin_life(const AgentStateView& state, const AgentBox& box, int32_t agent) {
    const size_t at = slot(agent);
    lives[agent] = state.life[at];
    chains[agent] = -1;
    const float* conditioning = state.conditioning + at * kNumConditioning;
    agents[agent] = next_agent++;
    max_agents = std::max(max_agents, next_agent);
    later_lives.push_back({replay.episodes.size() - 1,
                           agent,
                           agents[agent],
                           body_of(box),
                           {conditioning, conditioning + kNumConditioning}});
  }

  // Adds zeros for the step before the next frame, because no step led to that frame.
  void add_no_step() {
    const auto count = static_cast<size_t>(replay.num_agents);
    const auto add_zeros = [count](std::vector<int32_t>& values) { values.insert(values.end(), count, 0); };
    add_zeros(track(Track::action));
#define X(name) add_zeros(track(Track::reward_##name));
    PICTURA_REWARD_TERMS(X)
#undef X
  }

  void add_frame(bool new_episode = false) {
    const AgentStateView state = simulator.state();
    const SceneBatch& scene = simulator.scene();
    const Span<const AgentBox> boxes = scene.agents.subspan(first_box, num_boxes);
    const bool begins = new_episode || replay.episodes.empty() || episode().index != simulator.episode_index()[world];
    if (begins) begin_episode(state, boxes);
    for (int32_t agent = 0; agent < replay.num_agents; ++agent) add_agent(state, boxes, agent, begins);
    agent_of.insert(agent_of.end(), agents.begin(), agents.end());
    const Span<const LightState> lights = scene.light_states.subspan(first_light, replay.num_lights);
    for (const LightState light : lights) replay.lights.push_back(static_cast<uint8_t>(light));
    ++episode().num_frames;
    ++replay.num_frames;
    if (cameras) add_images();
  }

  void add_agent(const AgentStateView& state, Span<const AgentBox> boxes, int32_t agent, bool begins) {
    const size_t at = slot(agent);
    const AgentBox& box = boxes[agent];
    const bool absent = is_absent(state, agent);
    if (state.life[at] != lives[agent]) begin_life(state, box, agent);
    track(Track::status).push_back(static_cast<int32_t>(absent ? AgentStatus::absent : state.status[at]));
    track(Track::halt_reason).push_back(state.halt_reason[at]);
    track(Track::next_waypoint).push_back(absent ? 0 : state.next_waypoint[at]);
    track(Track::events).push_back(begins ? 0 : state.events[at]);
    track(Track::x_m).push_back(absent ? 0 : centimetres(box.center_m.x));
    track(Track::y_m).push_back(absent ? 0 : centimetres(box.center_m.y));
    track(Track::z_m).push_back(absent ? 0 : centimetres(box.center_m.z));
    std::vector<int32_t>& headings = track(Track::heading_deg);
    const auto count = static_cast<size_t>(replay.num_agents);
    headings.push_back(absent   ? 0
                       : begins ? heading_of(box)
                                : near_heading(heading_of(box), headings[headings.size() - count]));
    track(Track::speed_mps).push_back(absent ? 0 : centimetres(state.speed_mps[at]));
    track(Track::steer_deg).push_back(absent ? 0 : tenths_of_degree(state.steer_rad[at]));
    if (absent || chains[agent] == state.goal_chains[at]) return;
    chains[agent] = state.goal_chains[at];
    ReplayChain chain{.frame = replay.num_frames, .agent = agent};
    for (size_t i = 0; i < kNumWaypoints; ++i) {
      chain.x_cm[i] = centimetres(state.waypoint_x_m[at * kNumWaypoints + i]);
      chain.y_cm[i] = centimetres(state.waypoint_y_m[at * kNumWaypoints + i]);
      chain.z_cm[i] = centimetres(state.waypoint_z_m[at * kNumWaypoints + i]);
    }
    episode().chains.push_back(chain);
  }

  // Ends the recording before the first frame that would exceed max_numbers.
  void end_if_full() {
    if (is_full) return;
    const AgentStateView state = simulator.state();
    int32_t entered = 0;
    for (int32_t agent = 0; agent < replay.num_agents; ++agent) entered += state.life[slot(agent)] > lives[agent];
    const int32_t num_agents = std::max(max_agents, next_agent + entered);
    is_full = replay.num_frames >= max_frames(num_agents, max_numbers);
    if (is_full) {
      print_message("notice: replay: recorded the first {} steps: {} agents are too many for more\n",
                    replay.num_frames - 1, num_agents);
    }
  }

  void add_images() {
    group += cameras->draw(static_cast<int>(slot(replay.followed)));
    if (replay.num_frames % kReplayFramesPerGroup == 0) end_group();
  }
  void end_group() {
    if (!group.empty()) replay.images.groups.push_back(pack_images(replay.cameras, group));
    group.clear();
  }

  void add_decision() {
    if (replay.decisions.empty() && !decision) return;
    replay.decisions.resize(static_cast<size_t>(replay.num_frames) * kDecisionValues);
    if (!decision) return;
    int32_t* values = replay.decisions.data() + static_cast<size_t>(replay.num_frames - 1) * kDecisionValues;
    for (const float probability : decision->probabilities) {
      *values++ = in_units(static_cast<double>(probability), kDecisionUnit);
    }
    *values = in_units(static_cast<double>(decision->value), kDecisionUnit);
    decision.reset();
  }

  /// Adds the action and the reward of every agent for the step that led to the next frame.
  void add_step(const StepResult& result) {
    const AgentStateView state = simulator.state();
    for (int32_t agent = 0; agent < replay.num_agents; ++agent) {
      const size_t at = slot(agent);
      if (result.valid[at]) {
        count(state.events[at], result.sums[at], result.reward[at]);
        if (replay.first_infraction.frame < 0 && (state.events[at] & kInfractions) != 0) {
          replay.first_infraction = {replay.num_frames, agent};
        }
      }
      const Command& command = commands[agent];
      const bool acts = result.valid[at] && command.kind == CommandKind::action;
      track(Track::action).push_back(acts ? 1 + command.action : 0);
      const RewardTerms& terms = result.sums[at].reward_terms;
#define X(name) track(Track::reward_##name).push_back(in_units(static_cast<double>(terms.name), kRewardUnit));
      PICTURA_REWARD_TERMS(X)
#undef X
    }
  }

  void count(int events, const StepSums& sums, float reward) {
    ReplayMetrics& m = replay.metrics;
    ++m.agent_steps;
#define X(name, logged, counted) m.name += (events & (counted)) != 0;
    PICTURA_EVENT_TOTALS(X)
#undef X
    m.km_driven += static_cast<double>(sums.distance_m) / 1000;
    m.reward += static_cast<double>(reward);
  }

  Simulator& simulator;
  const int world;
  const int64_t max_numbers;
  const SimulatorSetup setup;
  std::optional<ReplayDecision> decision;  // for the next step
  std::vector<Command> commands;
  int32_t first_slot = 0, first_box = 0, num_boxes = 0, first_light = 0;
  std::vector<int32_t> chains;  // [agents] number of the last written chain
  std::vector<int32_t> lives;   // [agents] last written life
  // Each life is an agent of the finished replay: [slots] now, and [frames, slots].
  std::vector<int32_t> agents, agent_of;
  int32_t next_agent = 0, max_agents = 0;  // numbers of agents of this episode, and of the finished replay
  std::vector<LaterLife> later_lives;
  bool is_full = false;
  std::unique_ptr<AgentCameras> cameras;
  std::string group;  // images that are not yet compressed
  Replay replay;
};

void check_replay_room(int num_agents, int64_t num_steps) {
  const int64_t frames = max_frames(num_agents, kMaxReplayNumbers);
  PICTURA_CHECK(num_steps + 1 <= frames, "replay: {} agents are too many for more than {} steps: record fewer steps",
                num_agents, frames - 1);
}

Recorder::Recorder(Simulator& simulator, const RecorderOptions& options) {
  if (!simulator.device().is_host()) {
    fail_usage("replay: expected a simulator in host memory, got one on {}", name_of(simulator.device()));
  }
  const auto num_worlds = static_cast<int>(simulator.worlds().size());
  if (options.world < 0 || options.world >= num_worlds) {
    fail_usage("replay: expected a world of 0 to {}, got {}", num_worlds - 1, options.world);
  }
  const int num_agents = simulator.worlds()[options.world].num_agents;
  if (options.followed < -1 || options.followed >= num_agents) {
    fail_usage("replay: expected an agent of 0 to {} to follow, got {}", num_agents - 1, options.followed);
  }
  parts_ = std::make_unique<Parts>(simulator, options);
  parts_->add_no_step();
  parts_->add_frame();
}

Recorder::~Recorder() = default;

void Recorder::decide(const ReplayDecision& decision) { parts_->decision = decision; }

void Recorder::before_step(Span<const Command> commands) {
  Parts& parts = *parts_;
  PICTURA_CHECK(commands.size() == static_cast<size_t>(parts.simulator.num_slots()),
                "replay: expected {} commands, got {}", parts.simulator.num_slots(), commands.size());
  if (parts.is_full) return;
  const auto agents = static_cast<size_t>(parts.replay.num_agents);
  const Span<const Command> of_world = commands.subspan(parts.slot(0), agents);
  parts.commands.assign(of_world.begin(), of_world.end());
  parts.add_decision();
}

void Recorder::after_step(const StepResult& result) {
  Parts& parts = *parts_;
  parts.end_if_full();
  if (parts.is_full) return;
  parts.add_step(result);
  parts.add_frame();
}

void Recorder::after_reset(Span<const uint8_t> world_mask) {
  Parts& parts = *parts_;
  if (!world_mask.empty() && !world_mask[static_cast<size_t>(parts.world)]) return;
  parts.decision.reset();
  parts.end_if_full();
  if (parts.is_full) return;
  parts.take_seed();
  parts.add_no_step();
  parts.add_frame(/*new_episode=*/true);
}

const Replay& Recorder::recorded() const { return parts_->replay; }

void Recorder::set_origin(ReplayOrigin origin) {
  Parts& parts = *parts_;
  const CompiledMap& map = parts.setup.map_of(parts.world);
  origin.map = map.road->name;
  origin.map_origin_m = map.road->origin_m;
  origin.map_hash = fmt::format("{:016x}", map.fingerprint);
  origin.seed = parts.replay.origin.seed;
  origin.global_world = parts.setup.worlds[parts.world].global_world;
  origin.dt_s = parts.setup.config.dt_s;
  origin.light_cycles = light_cycles_text(parts.setup.config, map);
  parts.replay.origin = std::move(origin);
}

std::vector<int32_t> Recorder::discard_history() {
  Parts& parts = *parts_;
  Replay& replay = parts.replay;
  PICTURA_CHECK(replay.followed < 0, "replay: frames with decisions or images cannot be discarded");
  const auto keep_last = [](auto& values, int32_t count) { values.erase(values.begin(), values.end() - count); };
  for (std::vector<int32_t>& track : replay.tracks) keep_last(track, replay.num_agents);
  keep_last(replay.lights, replay.num_lights);
  const size_t last_episode = replay.episodes.size() - 1;
  keep_last(replay.episodes, 1);
  ReplayEpisode& episode = replay.episodes.back();
  episode.first_frame = 0;
  episode.num_frames = 1;
  // Keeps the current chain of each agent.
  std::vector<const ReplayChain*> last(static_cast<size_t>(replay.num_agents), nullptr);
  for (const ReplayChain& chain : episode.chains) last[chain.agent] = &chain;
  std::vector<ReplayChain> kept;
  for (const ReplayChain* chain : last) {
    if (chain == nullptr) continue;
    kept.push_back(*chain);
    kept.back().frame = 0;
  }
  episode.chains = std::move(kept);
  replay.first_infraction = {};
  replay.num_frames = 1;
  std::vector<int32_t> entered;
  for (const LaterLife& life : parts.later_lives) {
    if (life.episode != last_episode) continue;
    set_agent(life, life.slot, &episode);
    entered.push_back(life.slot);
  }
  parts.later_lives.clear();
  parts.reset_agents();
  parts.agent_of = parts.agents;
  parts.max_agents = replay.num_agents;
  return entered;
}

Replay Recorder::finish(ReplayOrigin origin, std::vector<int32_t>* agent_of_out) {
  Parts& parts = *parts_;
  set_origin(std::move(origin));
  if (!parts.replay.decisions.empty()) {
    parts.replay.decisions.resize(static_cast<size_t>(parts.replay.num_frames) * kDecisionValues);
  }
  if (parts.cameras) parts.end_group();
  split_lives(parts.later_lives, parts.agent_of, parts.max_agents, &parts.replay);
  if (agent_of_out) *agent_of_out = std::move(parts.agent_of);
  return std::move(parts.replay);
}

}  // namespace pictura
