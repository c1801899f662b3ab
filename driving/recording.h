// Records a simulated world as a replay, with the policy's responses for one agent.
#pragma once

#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/renderer.h"
#include "pictura/common/support/filled_folder.h"
#include "pictura/replay/recorder.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

class PolicySession;
struct DrivenWorld;

struct RecordingOptions {
  std::optional<int> followed;  // slot; if empty, resolve_followed() chooses it
  bool cameras = false;
};

/// Follows DrivenWorld::first_agent if no agent was requested. Throws UsageError if the requested agent does not exist.
void resolve_followed(const DrivenWorld& world, RecordingOptions* options_inout);

/// Driver of a recorded world. A controller has no session; its replays have the paper's cameras.
struct RecordedDriver {
  std::string policy;  // name or path, as requested
  PolicySession* session = nullptr;
  Renderer* renderer = nullptr;  // for the session's images
};

/// Returns the configuration of the policy's images, or of the paper's cameras.
RendererConfig cameras_of(const RecordedDriver& driver);
/// Returns the policy's response to an agent's observation in the simulator's only world. Empty for a controller or an
/// inactive agent.
std::optional<ReplayDecision> decision_of_agent(Simulator& simulator, const RecordedDriver& driver, int agent);
/// Returns this process's command and version, and the driver.
ReplayOrigin origin_of(const RecordedDriver& driver);

/// Records the only world of a simulator in host memory.
class Recording final : public StepObserver {
 public:
  /// The simulator and the driver's objects must outlive the recording. Throws UsageError if the followed agent does
  /// not exist.
  Recording(Simulator& simulator, const RecordedDriver& driver, const RecordingOptions& options);
  ~Recording() override;

  void before_step(Span<const Command> commands) override;
  void after_step(const StepResult& result) override;

  /// Ends the recording. agent_of_out: as in Recorder::finish().
  Replay finish(std::vector<int32_t>* agent_of_out = nullptr);

 private:
  struct Parts;
  std::unique_ptr<Parts> parts_;
};

/// Writes a page, and reports it on stderr.
void write_replay_with_message(const std::string& path, const Replay& replay);
/// Writes an MCAP file, and reports it on stderr.
void write_mcap_with_message(const std::string& path, const Replay& replay);

/// Removes pages of earlier galleries from the folder, writes an index, and reports it on stderr.
void write_index(FilledFolder* pages);

/// Returns this process's command, quoted for a shell, without the program's folder.
std::string command_line();

}  // namespace pictura
