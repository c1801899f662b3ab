// Records a simulated world as a replay, with the policy's responses for the followed agent.
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
  std::optional<int> followed;  // number of the followed agent; if empty, resolve_followed() sets it
  bool cameras = false;
};

/// Sets the followed agent to the world's default agent (DrivenWorld::first_agent) if none was requested. Throws
/// UsageError if the requested agent does not exist in the world.
void resolve_followed(const DrivenWorld& world, RecordingOptions* options_inout);

/// Driver of a recorded world, and the renderer of the driver's images. A controller (a driver that is not a policy)
/// has no session. Its replays have the cameras of the paper (default RendererConfig).
struct RecordedDriver {
  std::string policy;  // name or path, as requested
  PolicySession* session = nullptr;
  Renderer* renderer = nullptr;  // renderer of the session's images
};

/// Returns the renderer configuration of the policy's images, or of the paper's cameras for a controller.
RendererConfig cameras_of(const RecordedDriver& driver);
/// Returns the policy's response to the current observation of an agent in the simulator's only world. Returns nothing
/// if the driver is not a policy or the agent is not active.
std::optional<ReplayDecision> decision_of_agent(Simulator& simulator, const RecordedDriver& driver, int agent);
/// Returns the origin of a replay: this process's command and version, and the driver.
ReplayOrigin origin_of(const RecordedDriver& driver);

/// Records the only world of a simulator in host memory.
class Recording final : public StepObserver {
 public:
  /// Starts recording. The simulator and the driver's objects must outlive the recording. Throws UsageError if the
  /// followed agent does not exist.
  Recording(Simulator& simulator, const RecordedDriver& driver, const RecordingOptions& options);
  ~Recording() override;

  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;

  /// Returns the replay so far, and ends the recording.
  Replay finish();

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Writes a replay to `path` as a page, and reports the file on stderr.
void write_replay_with_message(const std::string& path, const Replay& replay);
/// Writes a replay to `path` as an MCAP file, and reports the file on stderr.
void write_mcap_with_message(const std::string& path, const Replay& replay);

/// Finishes a gallery: removes pages of earlier galleries from the folder, writes an index of the new pages, and
/// reports the gallery on stderr.
void write_index(FilledFolder* pages);

/// Returns this process's command, quoted for a shell. The program's name is without its folder.
std::string command_line();

}  // namespace pictura
