#include "pictura/driving/recording.h"

#include <algorithm>
#include <filesystem>

#include "pictura/commit.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/common/support/messages.h"
#include "pictura/driving/world.h"
#include "pictura/policy/session.h"
#include "pictura/replay/file.h"
#include "pictura/replay/gallery.h"
#include "pictura/replay/mcap.h"
#include "pictura/replay/recorder.h"
#include "pictura/version.h"

namespace pictura {

namespace {

/// Selects the observations of one slot.
ObservationView of_slot(const ObservationView& all, size_t slot) {
  ObservationView one;
#define X(name, type, rows, features, part, comment) \
  if (!all.name.empty()) one.name = all.name.subspan(slot * (rows) * (features), (rows) * (features));
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  return one;
}

/// Returns a word, quoted for a shell if necessary.
std::string quoted(const std::string& word) {
  constexpr std::string_view kPlain = "ABCDEFGHIJKLMNOPQRSTUVWXYZabcdefghijklmnopqrstuvwxyz0123456789_-+=.,:/@%";
  if (!word.empty() && word.find_first_not_of(kPlain) == std::string::npos) return word;
  std::string text = "'";
  for (const char c : word) {
    if (c == '\'')
      text += "'\\''";
    else
      text += c;
  }
  text += '\'';
  return text;
}

void report_file(const std::string& path, const Replay& replay) {
  std::error_code none;  // set if the path is a device, which has no size
  const auto bytes = std::filesystem::file_size(path, none);
  print_message("{}: {} agents, {} steps{}\n", path, replay.num_agents, replay.num_frames - 1,
                none ? "" : fmt::format(", {:.2f} MB", static_cast<double>(bytes) / 1e6));
}

}  // namespace

void resolve_followed(const DrivenWorld& world, RecordingOptions* options_inout) {
  const int num_agents = world.simulator->num_slots(), followed = options_inout->followed.value_or(world.first_agent);
  if (followed >= num_agents) fail_usage("--follow: expected 0 to {}, got {}", num_agents - 1, followed);
  options_inout->followed = followed;
}

std::string command_line() {
  const std::string words = read_file("/proc/self/cmdline");
  std::string line;
  for (size_t begin = 0; begin < words.size();) {
    const size_t end = std::min(words.find('\0', begin), words.size());
    const std::string word = words.substr(begin, end - begin);
    if (begin == 0) {
      line = std::filesystem::path(word).filename().string();
    } else {
      line += ' ';
      line += quoted(word);
    }
    begin = end + 1;
  }
  return line;
}

RendererConfig cameras_of(const RecordedDriver& driver) {
  if (driver.session && driver.session->reads_images()) return driver.session->renderer_config();
  return {};
}

std::optional<ReplayDecision> decision_of_agent(Simulator& simulator, const RecordedDriver& driver, int agent) {
  const auto slot = static_cast<size_t>(agent);
  if (!driver.session || simulator.state().status[slot] != AgentStatus::active) return {};
  std::array<float, kNumActions> logits{};
  std::array<float, 1> value{};
  driver.session->evaluate(
      {of_slot(simulator.observations(), slot), &simulator.scene(), simulator.views().subspan(slot, 1), {}},
      driver.renderer, logits, value);
  return decision_of(logits, value[0]);
}

ReplayOrigin origin_of(const RecordedDriver& driver) {
  ReplayOrigin origin{.command = command_line(), .commit = PICTURA_COMMIT, .version = PICTURA_VERSION};
  origin.policy = origin.policy_hash = driver.policy;
  if (driver.session) origin.policy_hash = driver.session->policy_hash();
  return origin;
}

struct Recording::Parts {
  Parts(Simulator& its_simulator, RecordedDriver its_driver, const RecordingOptions& options)
      : simulator(its_simulator),
        driver(std::move(its_driver)),
        followed(options.followed.value_or(0)),
        recorder(simulator, {.followed = followed, .cameras = cameras_of(driver), .keeps_images = options.cameras}) {}

  Simulator& simulator;
  const RecordedDriver driver;
  const int followed;
  Recorder recorder;
};

Recording::Recording(Simulator& simulator, const RecordedDriver& driver, const RecordingOptions& options)
    : parts_(std::make_unique<Parts>(simulator, driver, options)) {}

Recording::~Recording() = default;

void Recording::before_step(Span<const Command> commands) {
  const auto decision = decision_of_agent(parts_->simulator, parts_->driver, parts_->followed);
  if (decision) parts_->recorder.decide(*decision);
  parts_->recorder.before_step(commands);
}

void Recording::after_step(const StepResult& result) { parts_->recorder.after_step(result); }

Replay Recording::finish(std::vector<int32_t>* agent_of_out) {
  return parts_->recorder.finish(origin_of(parts_->driver), agent_of_out);
}

void write_replay_with_message(const std::string& path, const Replay& replay) {
  write_replay(path, replay);
  report_file(path, replay);
}

void write_mcap_with_message(const std::string& path, const Replay& replay) {
  write_mcap(path, replay);
  report_file(path, replay);
}

void write_index(FilledFolder* pages) {
  const std::string index = pages->file("index.html");
  pages->remove_others();
  print_message("{}: {} replays\n", index, write_gallery(pages->path()));
}

}  // namespace pictura
