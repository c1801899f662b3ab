#include "pictura/cli/serve.h"

#include <algorithm>
#include <chrono>

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/common/support/numbers.h"
#include "pictura/replay/server.h"

namespace pictura {

namespace {

using Clock = std::chrono::steady_clock;

constexpr std::chrono::milliseconds kGlance{50};           // between two looks at whether to end
constexpr std::chrono::milliseconds kMaxBehind{500};       // later steps are not made up for
constexpr std::chrono::seconds kKeysHold{1}, kHandsOn{5};  // without word from the page that drives
constexpr std::chrono::milliseconds kGoodbye{1000};

/// What CLI11 gives for an option without its value, by its version.
bool is_no_port(const std::string& text) { return text.empty() || text == "true"; }

}  // namespace

void add_serve_options(CLI::App* command, ServeOptions* options_out) {
  command
      ->add_option_function<std::string>(
          "--serve",
          [options_out](const std::string& text) {
            options_out->is_asked = true;
            if (is_no_port(text)) return;
            const std::optional<uint64_t> port = parse_unsigned(text);
            if (!port || *port < 1 || *port > 65535)
              fail_usage("--serve: expected a port of 1 to 65535, got '{}'", text);
            options_out->port = static_cast<int>(*port);
          },
          "Let a browser watch, pause, step and drive: prints the page's address, on this machine alone. It begins "
          "when a page opens, runs in real time, and without --steps goes on until ^C. Default port: a free one")
      ->type_name("[PORT]")
      ->expected(0, 1);
  command->add_option("--serve-host", options_out->host_name,
                      "With --serve: listen on all of this machine's addresses, for pages that name it so. Whoever "
                      "has the address can then drive; nothing is encrypted");
}

struct Serving::Parts {
  Parts(const ServeOptions& options, Simulator& its_simulator, RecordedDriver its_driver,
        const RecordingOptions& recording)
      : simulator(its_simulator),
        driver(std::move(its_driver)),
        world(simulator, origin_of(driver), recording.cameras ? std::optional(cameras_of(driver)) : std::nullopt),
        server({.port = options.port, .host_name = options.host_name, .num_agents = world.num_agents()}),
        watched(recording.followed) {}

  LiveJson status() const { return {{"paused", paused}, {"pace", pace}, {"watched", watched}, {"driven", driven}}; }
  LiveJson look() { return world.look(decision_of_agent(simulator, driver, watched), watched); }

  void apply(const LiveRequest& asked) {
    if (asked.paused) paused = *asked.paused;
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
      server.send("look", [this] { return look(); });
    }
  }

  // What pages asked since the last time, and what they have not been told.
  void attend() {
    const std::vector<LiveRequest> requests = server.take_requests();
    for (const LiveRequest& asked : requests) apply(asked);
    const bool silent = driven >= 0 && Clock::now() - heard > kHandsOn;
    if (silent) driven = -1;
    if (!requests.empty() || silent) server.send("status", [this] { return status(); });
    if (!server.has_newcomers()) return;
    if (!has_begun) due = Clock::now();
    has_begun = true;
    server.greet({{"begin", world.begin()}, {"status", status()}, {"look", look()}});
  }

  bool await_step() {
    while (!interrupted()) {
      attend();
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
      server.wait_until(runs ? std::min(due, now + kGlance) : now + kGlance);
    }
    return false;
  }

  void before_step(Span<Command> commands_inout) {
    if (driven >= 0) {
      const DrivingKeys held = Clock::now() - heard > kKeysHold ? DrivingKeys{} : keys;
      commands_inout[static_cast<size_t>(driven)] = {
          .action = action_of_keys(held, simulator.state(), driven, simulator.config().dt_s)};
    }
    world.before_step(commands_inout);
  }

  void after_step(const StepResult& result) {
    world.after_step(result);
    server.send("frame", [this] { return world.frame(); });
    server.send("look", [this] { return look(); });
  }

  Simulator& simulator;
  const RecordedDriver driver;
  LiveWorld world;
  LiveServer server;
  bool has_begun = false, paused = false;
  int steps_asked = 0, watched = 0, driven = -1;
  double pace = 1;
  DrivingKeys keys;
  Clock::time_point due, heard;
};

Serving::Serving(const ServeOptions& options, Simulator& simulator, const RecordedDriver& driver,
                 const RecordingOptions& recording)
    : parts_(std::make_unique<Parts>(options, simulator, driver, recording)) {
  fmt::print(stderr, "serving {} (^C ends it)\n", parts_->server.address());
}

Serving::~Serving() = default;

bool Serving::await_step() { return parts_->await_step(); }
void Serving::before_step(Span<Command> commands_inout) { parts_->before_step(commands_inout); }
void Serving::after_step(const StepResult& result) { parts_->after_step(result); }

void Serving::finish() {
  parts_->attend();
  parts_->server.send("end", [this] { return LiveJson{{"step", parts_->world.step()}}; });
  parts_->server.flush(kGoodbye);
}

}  // namespace pictura
