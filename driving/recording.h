// Recording what drives in a world as replays, and what a policy makes of the followed agent.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "pictura/common/renderer.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/replay/recorder.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

class PolicySession;
struct DrivenWorld;

struct RecordingOptions {
  std::optional<int> followed;  // nothing: settle_followed() chooses
  bool cameras = false;
};

/// Follows the world's first agent where nothing was asked for. Throws UsageError unless the world has the followed
/// one.
void settle_followed(const DrivenWorld& world, RecordingOptions* options_inout);

/// Who drives, and what draws. A controller has no session; without it, cameras are the paper's.
struct RecordedDriver {
  std::string policy;  // as it was asked for
  PolicySession* session = nullptr;
  Renderer* renderer = nullptr;  // of the session's images
};

/// What draws the images that its policy sees, else the paper's.
RendererConfig cameras_of(const RecordedDriver& driver);
/// What the policy makes of an agent of the only world now; nothing where it is not asked.
std::optional<ReplayDecision> decision_of_agent(Simulator& simulator, const RecordedDriver& driver, int agent);
/// This process, its command and who drives.
ReplayOrigin origin_of(const RecordedDriver& driver);

/// Records the only world of a simulator in host memory.
class Recording final : public StepObserver {
 public:
  /// The simulator and what the driver names must outlive it. Throws UsageError where there is no such agent.
  Recording(Simulator& simulator, const RecordedDriver& driver, const RecordingOptions& options);
  ~Recording() override;

  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;

  /// The replay until now, of which nothing more can be recorded.
  Replay finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Writes a replay under this name, and what was written on stderr.
void write_replay_and_say_so(const std::string& path, const Replay& replay);
void write_mcap_and_say_so(const std::string& path, const Replay& replay);

/// Removes the pages of a gallery that earlier calls wrote, lists the others, and says so on stderr.
void write_index(FilledFolder* pages);

/// This process's command, as a shell would read it; the program without its folder.
std::string command_line();

}  // namespace pictura
