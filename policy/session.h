// Session with a saved policy: runs the policy on scenes and observations, and provides the settings of images and
// worlds with which the policy was trained. Includes no torch headers.
#pragma once

#include <memory>
#include <optional>
#include <string>

#include "pictura/common/renderer.h"
#include "pictura/configuration/apply_config.h"
#include "pictura/policy/session_options.h"
#include "pictura/simulator/controllers/controller.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

class Policy;
struct Config;
struct SessionParts;

/// Returns the training configuration with the changes of the options. Device settings of the training configuration
/// are replaced by those of the options, because they depend on the machine. Unless the options name a renderer, the
/// renderers cpu and cuda become auto, because all three draw the same images.
Config with_session_options(const Config& trained, const SessionOptions& options);

/// Observations of a batch of agents. All arrays are in the memory of the session's device.
struct PolicyInput {
  ObservationView observations;       // [batch]; arrays that the policy does not read may be empty
  const SceneBatch* scene = nullptr;  // scene of the views; needed if the policy reads images
  Span<const View> views;             // [batch]
  Span<const uint8_t> is_drawn;       // [batch] 0: the agent's images are black; empty: all images are drawn
  // Above 0: fixed number of agents in each pass through the network. An agent's output may then depend on its position
  // in the pass, but not on the batch size. 0: equal parts of the batch, of at most train.forward_chunk agents.
  int64_t full_chunk = 0;
  // Replaces auxiliary features by zeros, for a policy that was trained without them.
  bool hides_auxiliary = false;
};

/// Controller that drives agents with a policy. On a device, act() waits for two counts: of the agents that it drives,
/// and of those that choose a new action.
class PolicyController : public Controller {
 public:
  /// Number of agents that the last act() commanded: the active agents that its mask selects.
  virtual int64_t num_driven() const = 0;
};

/// Returns the cameras that the options define; nullopt if they define none. Throws UsageError if the options have both
/// a rig file and an image size. Throws Error as load_rig() does.
std::optional<Rig> named_rig(const SessionOptions& options);

/// Variant of renderer_config() for evaluations: randomized cameras of a world are the same for all policies.
RendererConfig evaluation_renderer_config(const Config& config, const Rig& rig, Device device);

/// Session with a policy. Only one thread may use it at a time. In builds with torch, torch computes the policy; in
/// other builds, policy/host_network.h does.
class PolicySession {
 public:
  /// Opens the policy of a checkpoint, or of a safetensors file that training or `pictura export` wrote. Throws Error,
  /// which names the file, if the file is neither or is truncated, if its observation schema or architecture differs
  /// from the current one, or if the policy cannot run on this device. Throws UsageError if the policy cannot use the
  /// cameras of the options.
  explicit PolicySession(const std::string& path, const SessionOptions& options = {});
  /// Wraps a policy with its configuration and the cameras of `rig`, which are not randomized. Every call uses the
  /// current weights of the policy. The policy must outlive the session. Builds without torch do not have this
  /// constructor.
  PolicySession(const Config& config, const Rig& rig, Device device, const Policy& policy);
  /// Creates a session from its implementation (policy/session_parts.h).
  explicit PolicySession(std::unique_ptr<SessionParts> parts);
  ~PolicySession();
  /// Returns a session with an untrained policy of the same architecture, with the same worlds and cameras. Its weights
  /// are initialized from `seed` as for training; a backbone program (policy.backbone) keeps the weights of its file.
  /// Throws Error in builds without torch.
  std::unique_ptr<PolicySession> make_untrained(uint64_t seed) const;
  PolicySession(const PolicySession&) = delete;
  PolicySession& operator=(const PolicySession&) = delete;

  bool reads_images() const;
  const Rig& rig() const;
  /// Severity of the randomization of cameras: camera_severity of the options.
  double camera_severity() const;
  /// Device of the network. Simulators, renderers and all arrays passed to the session use its memory.
  Device device() const;

  /// Renderer configuration of the policy's images: cameras, randomization and samples as the options specify; line
  /// floor (minimum width of drawn lines) and palette as in training.
  RendererConfig renderer_config() const;
  /// Creates a renderer of the policy's images that draws in the memory of device(). The caller must upload the maps.
  /// Returns null if the policy reads no images. Throws Error if the renderer cannot run on this machine.
  std::unique_ptr<Renderer> make_renderer() const;

  /// Configuration of the worlds of the policy's training: walls and their seed, population, conditioning, episodes,
  /// and the observations that the policy reads.
  SimulatorConfig training_world() const;
  /// Configuration of the worlds of the paper's evaluation: episodes of `steps` steps without early end, with fixed
  /// conditioning and fixed light timings.
  SimulatorConfig evaluation_world(int steps) const;
  /// Training configuration with the changes of the options.
  const Config& config() const;
  /// Hash of the policy's weights.
  std::string policy_hash() const;

  /// Writes logits [batch, kNumActions] and values [batch]. `renderer` must have renderer_config(), and hold the
  /// scene's maps under the handles of the scene; `renderer` may be null for policies without images. The size of
  /// values_out is the batch size. Throws Error, which names the array, if the size of another array does not fit the
  /// batch size.
  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out, Span<float> values_out);

  /// Creates a controller for a simulator on device(). With `argmax`, it chooses the most likely action. Otherwise it
  /// draws actions as training does; draws depend only on (seed, global world, agent, episode, step). Each action is
  /// held for policy.decision_steps steps, counted from the first act(). For `renderer` see evaluate(). The session and
  /// the renderer must outlive the controller. Images are drawn only for agents that choose a new action.
  /// hides_auxiliary: see PolicyInput.
  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool hides_auxiliary = false);

 private:
  std::unique_ptr<SessionParts> parts_;
};

}  // namespace pictura
