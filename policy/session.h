// Session with a saved policy: evaluates scenes and observations, and holds the settings of images and world with which
// it was trained. Has no torch headers.
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

/// Returns the training configuration with the changes of the options. Device settings of training are ignored, since
/// they belong to the machine that trained the policy: any renderer that draws the same images may be used.
Config with_session_options(const Config& trained, const SessionOptions& options);

/// Observations of a batch of agents, in the memory of the session's device.
struct PolicyInput {
  ObservationView observations;       // [batch]; arrays that the policy does not read may be empty
  const SceneBatch* scene = nullptr;  // scene with the views, for a policy that reads images
  Span<const View> views;             // [batch]
  Span<const uint8_t> is_drawn;       // [batch] 0: the agent's images are black; empty: all are drawn
  // > 0: fixed number of agents in each pass through the network, so that an agent's output may depend on its position
  // in the pass, but not on the batch size. 0: equal parts of the batch, of at most train.forward_chunk agents.
  int64_t full_chunk = 0;
  // Replaces the auxiliary slots by zeros, for a policy that was trained without them.
  bool hides_auxiliary = false;
};

/// Controller with a policy. On a device, act() waits for two counts: of the agents that it drives, and of those that
/// decide.
class PolicyController : public Controller {
 public:
  /// Number of agents that the last act() commanded, which are the active agents that its mask selects.
  virtual int64_t num_driven() const = 0;
};

/// Returns the cameras that the options define; nullopt if they define none. Throws UsageError if they have both a rig
/// file and a size, and Error as load_rig() does.
std::optional<Rig> named_rig(const SessionOptions& options);

/// Returns renderer_config() of a configuration for evaluations, in which a world's cameras are the same for all
/// policies.
RendererConfig evaluation_renderer_config(const Config& config, const Rig& rig, Device device);

/// Session with a policy, which serves one thread at a time. Torch computes the policy if the build has it, else the
/// host does (policy/host_network.h).
class PolicySession {
 public:
  /// Opens the policy of a checkpoint, or of safetensors that training or `pictura export` wrote. Throws Error naming
  /// the file if it is neither, if it is truncated, if it has another observation schema or architecture, or if its
  /// policy cannot run on this device. Throws UsageError if the policy cannot use the cameras of the options.
  explicit PolicySession(const std::string& path, const SessionOptions& options = {});
  /// Wraps the policy of a configuration with the cameras of `rig`, which are not randomized. Every call uses the
  /// policy's weights at that time. The policy must outlive the session. Builds without torch lack this constructor.
  PolicySession(const Config& config, const Rig& rig, Device device, const Policy& policy);
  /// Creates a session from an implementation (policy/session_parts.h).
  explicit PolicySession(std::unique_ptr<SessionParts> parts);
  ~PolicySession();
  /// Returns the same policy before training, in the same worlds and with the same cameras: weights are drawn from
  /// `seed` as training draws them, except those of a backbone's program. Throws Error in builds without torch.
  std::unique_ptr<PolicySession> make_untrained(uint64_t seed) const;
  PolicySession(const PolicySession&) = delete;
  PolicySession& operator=(const PolicySession&) = delete;

  bool reads_images() const;
  const Rig& rig() const;
  /// Severity of the cameras' randomization: the options' camera_severity.
  double camera_severity() const;
  /// Device of the network. Simulators, renderers and all arrays passed to the session use its memory.
  Device device() const;

  /// Renderer configuration of the policy's images: rig, line floor, palette and samples of training, and cameras
  /// mounted as the options specify.
  RendererConfig renderer_config() const;
  /// Creates a renderer for the policy's images, in the memory of device(); the caller uploads the maps. Null if the
  /// policy reads no images. Throws Error if the renderer cannot run here.
  std::unique_ptr<Renderer> make_renderer() const;

  /// World configuration of the policy's training: walls and their seed, population, conditioning, episodes, and the
  /// observations that the policy reads.
  SimulatorConfig training_world() const;
  /// World configuration of the paper's evaluation: episodes of `steps` steps that nothing ends early, fixed
  /// conditioning and lights.
  SimulatorConfig evaluation_world(int steps) const;
  /// Training configuration with the changes of the options.
  const Config& config() const;
  /// Hash of the policy's weights.
  std::string policy_hash() const;

  /// Writes logits [batch, kNumActions] and values [batch]. `renderer` must have renderer_config() and hold the scene's
  /// maps under the handles in the scene; it may be null for policies without images. The size of values_out is the
  /// batch size. Throws Error naming an array whose size does not fit it.
  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out, Span<float> values_out);

  /// Creates a controller for a simulator on device(). Its actions are the most likely ones, or draws keyed by (seed,
  /// global world, agent, episode, step) as in training. Each action is held for the number of steps with which the
  /// policy was trained (policy.decision_steps), counted from the first act(). Session and renderer (see evaluate())
  /// must outlive the controller. Images are drawn only for agents that decide. hides_auxiliary: as in PolicyInput.
  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool hides_auxiliary = false);

 private:
  std::unique_ptr<SessionParts> parts_;
};

}  // namespace pictura
