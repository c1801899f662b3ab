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

/// Returns the training configuration with the changes of the options. Device settings belong to the machine that
/// trained the policy; here any renderer that draws the same images is used.
Config with_session_options(const Config& trained, const SessionOptions& options);

/// Observations of a batch of agents, in the memory of the session's device.
struct PolicyInput {
  ObservationView observations;       // [batch]; arrays that the policy does not read may be empty
  const SceneBatch* scene = nullptr;  // scene with the views, for a policy that reads images
  Span<const View> views;             // [batch]
  Span<const uint8_t> is_drawn;       // [batch] 0: the agent's images are black; empty: all are drawn
  // Fixed number of agents in each pass through the network if > 0, so that an agent's output depends on its position
  // in the chunk and not on the batch size. 0: at most train.forward_chunk, in equal parts of the batch.
  int64_t full_chunk = 0;
  // Replaces the auxiliary slots by zeros, for a policy that was trained without them.
  bool hides_auxiliary = false;
};

/// Controller with a policy. On a device act() waits for two counts: the agents that it drives, and those that decide.
class PolicyController : public Controller {
 public:
  /// Number of agents that the last act() commanded: the active agents of its mask.
  virtual int64_t num_driven() const = 0;
};

/// Returns the cameras that the options name; nullopt if they name none. Throws UsageError if they name both a rig file
/// and a size, and Error as load_rig() does.
std::optional<Rig> named_rig(const SessionOptions& options);

/// Returns renderer_config() of a configuration for evaluations, in which all policies see through the same cameras of
/// a world.
RendererConfig evaluation_renderer_config(const Config& config, const Rig& rig, Device device);

/// Session with a policy, which serves one thread at a time. Torch computes the policy if the build has it, else the
/// host does (policy/host_network.h).
class PolicySession {
 public:
  /// Opens the policy of a checkpoint, or of safetensors that training or `pictura export` wrote. Throws Error naming
  /// the file if it is neither, truncated, of another observation schema or architecture, or cannot run on this device.
  /// Throws UsageError if it cannot use the cameras of the options.
  explicit PolicySession(const std::string& path, const SessionOptions& options = {});
  /// Wraps a policy of a configuration with the cameras of `rig`. Each call uses the policy's current weights; the
  /// policy must outlive the session. Its cameras are not randomized. Builds without torch lack this constructor.
  PolicySession(const Config& config, const Rig& rig, Device device, const Policy& policy);
  /// Creates a session from the parts that an implementation made (policy/session_parts.h).
  explicit PolicySession(std::unique_ptr<SessionParts> parts);
  ~PolicySession();
  /// Returns the same policy before training, in the same worlds and with the same cameras: weights are drawn from
  /// `seed` as train draws them, except those of a backbone's program. Throws Error in builds without
  /// torch.
  std::unique_ptr<PolicySession> make_untrained(uint64_t seed) const;
  PolicySession(const PolicySession&) = delete;
  PolicySession& operator=(const PolicySession&) = delete;

  bool reads_images() const;
  const Rig& rig() const;
  /// Severity of the cameras' randomization: the options' camera_severity.
  double camera_severity() const;
  /// Device of the network. Simulators, renderers and all arrays passed to the session use its memory.
  Device device() const;

  /// Renderer configuration of its images: rig, line floor, palette and samples of training, and cameras mounted as the
  /// options specify.
  RendererConfig renderer_config() const;
  /// Creates a renderer for its images, in the memory of device(); the caller uploads the maps. Null if the policy
  /// reads no images. Throws Error if the renderer cannot run here.
  std::unique_ptr<Renderer> make_renderer() const;

  /// World of its training: walls and their seed, population, conditioning, episodes, and the observations that it
  /// reads.
  SimulatorConfig training_world() const;
  /// World of the paper's evaluation: episodes of `steps` that nothing ends early, fixed conditioning and lights.
  SimulatorConfig evaluation_world(int steps) const;
  /// Training configuration with the changes of the options.
  const Config& config() const;
  /// Hash of its weights.
  std::string policy_hash() const;

  /// Writes logits [batch, kNumActions] and values [batch]. `renderer` holds the scene's maps under the handles that
  /// the scene names, and has renderer_config(); policies without images need none. Throws Error naming an array whose
  /// size does not fit the batch, which is the size of values_out.
  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out, Span<float> values_out);

  /// Creates a controller for a simulator on device(). Its actions are the most likely ones, or draws keyed by (seed,
  /// global world, agent, episode, step) as in training. Actions are held for the steps that the policy was trained
  /// with (policy.decision_steps), counted from the first act(). Session and renderer (see evaluate()) must outlive the
  /// controller. Images are drawn only for agents that decide. hides_auxiliary: as in PolicyInput.
  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool hides_auxiliary = false);

 private:
  std::unique_ptr<SessionParts> parts_;
};

}  // namespace pictura
