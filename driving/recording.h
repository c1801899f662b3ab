// Records a driven world as a replay, with the policy's responses for the followed agent.
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
  std::optional<int> followed;  // empty: resolve_followed() chooses
  bool cameras = false;
};

/// Follows the world's first agent if none was requested. Throws UsageError if the world lacks the requested agent.
void resolve_followed(const DrivenWorld& world, RecordingOptions* options_inout);

/// Driver of a recorded world, and the renderer of its images. A controller has no session; its cameras are the
/// paper's.
struct RecordedDriver {
  std::string policy;  // as requested
  PolicySession* session = nullptr;
  Renderer* renderer = nullptr;  // renderer of the session's images
};

/// Renderer configuration of the policy's images; the paper's for a controller.
RendererConfig cameras_of(const RecordedDriver& driver);
/// The policy's present response for an agent of the only world; empty if the policy does not drive.
std::optional<ReplayDecision> decision_of_agent(Simulator& simulator, const RecordedDriver& driver, int agent);
/// Origin of a replay: this process, its command and the driver.
ReplayOrigin origin_of(const RecordedDriver& driver);

/// Records the only world of a simulator in host memory.
class Recording final : public StepObserver {
 public:
  /// Creates a recording. The simulator and the driver's objects must outlive it. Throws UsageError if the followed
  /// agent does not exist.
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

/// Writes a replay to `path`, and reports the file on stderr.
void write_replay_with_message(const std::string& path, const Replay& replay);
void write_mcap_with_message(const std::string& path, const Replay& replay);

/// Removes the pages of a gallery that earlier calls wrote, lists the other pages, and reports the gallery on stderr.
void write_index(FilledFolder* pages);

/// This process's command as a shell would read it, with the program's name without its folder.
std::string command_line();

}  // namespace pictura
