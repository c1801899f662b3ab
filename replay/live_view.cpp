#include "pictura/replay/live_view.h"

#include <algorithm>
#include <utility>

#include "pictura/common/error.h"
#include "pictura/replay/server.h"

namespace pictura {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kMaxBehind{500};              // maximum delay of steps that is caught up
constexpr std::chrono::seconds kKeysHold{1}, kDrivingTimeout{5};  // if the driving page sends no message
constexpr std::chrono::milliseconds kCloseTimeout{1000};
constexpr std::chrono::milliseconds kPollInterval{50};  // maximum wait of one is_due()

}  // namespace

struct LiveView::Parts {
  Parts(Simulator& its_simulator, const LiveViewOptions& options, const ReplayOrigin& origin, Decide its_decide)
      : simulator(its_simulator),
        decide(std::move(its_decide)),
        world(simulator, origin, options.cameras, options.sends_images),
        server({.port = options.port, .host_name = options.host_name, .num_agents = world.num_agents()}),
        has_begun(!options.waits_for_page),
        watched(options.watched),
        due(Clock::now()) {
    if (watched < 0 || watched >= world.num_agents()) {
      fail_usage("live view: expected an agent of 0 to {} to watch, got {}", world.num_agents() - 1, watched);
    }
  }

  LiveJson status() const { return {{"paused", paused}, {"pace", pace}, {"watched", watched}, {"driven", driven}}; }
  LiveJson agent_message() { return world.agent_message(decide(watched), watched); }

  void apply(const LiveRequest& asked) {
    if (asked.paused) {
      paused = *asked.paused;
      steps_asked = 0;
    }
    if (asked.steps) {
      paused = true;
      steps_asked = *asked.steps;
    }
    if (asked.paused || asked.steps) due = Clock::now();
    pace = asked.pace.value_or(pace);
    if (asked.driven) {
      driven = *asked.driven;
      keys = {};
      heard = Clock::now();
    }
    if (asked.keys) {
      keys = *asked.keys;
      heard = Clock::now();
    }
    if (asked.watched && *asked.watched != watched) {
      watched = *asked.watched;
      server.send("look", [this] { return agent_message(); });
    }
  }

  // Handles the requests of pages since the last call, and sends pending messages to the pages.
  void process_requests() {
    const std::vector<LiveRequest> requests = server.take_requests();
    for (const LiveRequest& asked : requests) apply(asked);
    const bool silent = driven >= 0 && Clock::now() - heard > kDrivingTimeout;
    if (silent) driven = -1;
    if (!requests.empty() || silent) server.send("status", [this] { return status(); });
    if (!server.has_ungreeted_pages()) return;
    if (!has_begun) due = Clock::now();
    has_begun = true;
    server.send_initial_events({{"begin", world.begin()}, {"status", status()}, {"look", agent_message()}});
  }

  bool is_due() {
    process_requests();
    const auto now = Clock::now();
    if (has_begun && paused && steps_asked > 0) {
      --steps_asked;
      return true;
    }
    const bool runs = has_begun && !paused;
    if (runs && now >= due) {
      const std::chrono::duration<double> pause(static_cast<double>(simulator.config().dt_s) / pace);
      due = std::max(due, now - kMaxBehind) + std::chrono::duration_cast<Clock::duration>(pause);
      return true;
    }
    server.wait_until(runs ? std::min(due, now + kPollInterval) : now + kPollInterval);
    return false;
  }

  void override_commands(Span<Command> commands_inout) {
    if (driven >= 0) {
      const DrivingKeys held = Clock::now() - heard > kKeysHold ? DrivingKeys{} : keys;
      commands_inout[driven] = {.action = action_of_keys(held, simulator.state(), driven, simulator.config().dt_s)};
    }
  }

  void send_frame() {
    server.send("frame", [this] { return world.frame(); });
    server.send("look", [this] { return agent_message(); });
  }

  Simulator& simulator;
  const Decide decide;
  LiveWorld world;
  LiveServer server;
  bool has_begun, paused = false;
  int steps_asked = 0, watched, driven = -1;
  double pace = 1;
  DrivingKeys keys;
  Clock::time_point due, heard;
};

LiveView::LiveView(Simulator& simulator, const LiveViewOptions& options, const ReplayOrigin& origin, Decide decide)
    : parts_(std::make_unique<Parts>(simulator, options, origin, std::move(decide))) {}

LiveView::~LiveView() = default;

const std::string& LiveView::address() const { return parts_->server.address(); }
int LiveView::num_pages() const { return parts_->server.num_pages(); }
bool LiveView::is_due() { return parts_->is_due(); }
void LiveView::override_commands(Span<Command> commands_inout) { parts_->override_commands(commands_inout); }
void LiveView::before_step(Span<const Command> commands) { parts_->world.before_step(commands); }

void LiveView::after_step(const StepResult& result) {
  parts_->world.after_step(result);
  parts_->send_frame();
}

void LiveView::after_reset(Span<const uint8_t> world_mask) {
  const int64_t step = parts_->world.step();
  parts_->world.after_reset(world_mask);
  if (parts_->world.step() != step) parts_->send_frame();
}

void LiveView::finish() {
  parts_->process_requests();
  parts_->server.send("end", [this] { return LiveJson{{"step", parts_->world.step()}}; });
  parts_->server.flush(kCloseTimeout);
}

}  // namespace pictura
