// Session with a saved policy. Includes no torch headers.
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

/// Returns the training configuration with the changes of the options. The options determine the device settings,
/// because these depend on the machine. Unless the options name a renderer, the renderers cpu and cuda become auto,
/// because both draw the same images.
Config with_session_options(const Config& trained, const SessionOptions& options);

/// Observations of a batch, in the memory of the session's device.
struct PolicyInput {
  ObservationView observations;       // [batch]; arrays that the policy does not read may be empty
  const SceneBatch* scene = nullptr;  // scene of the views, if the policy reads images
  Span<const View> views;             // [batch]
  Span<const uint8_t> is_drawn;       // [batch] 0: black images; empty: all are drawn
  // Above 0: agents per pass through the network. An output may then depend on its position in the pass, but not on the
  // batch size. 0: equal parts of at most train.forward_chunk agents.
  int64_t full_chunk = 0;
  // Zeroes auxiliary features, for a policy trained without them.
  bool hides_auxiliary = false;
};

/// Controller that drives agents with a policy. On a GPU, act() waits to read the number of agents that it commands.
class PolicyController : public Controller {
 public:
  /// Number of agents that the last act() commanded.
  virtual int64_t num_driven() const = 0;
};

/// Returns the options' cameras, if any. Throws UsageError for a rig file together with an image size. Throws Error as
/// load_rig() does.
std::optional<Rig> named_rig(const SessionOptions& options);

/// Variant of renderer_config() for evaluations: a world's randomized cameras are the same for all policies.
RendererConfig evaluation_renderer_config(const Config& config, const Rig& rig, Device device);

/// Session that runs a policy on scenes and observations. Only one thread may use it at a time. Without torch,
/// policy/host_network.h computes the policy.
class PolicySession {
 public:
  /// Opens the policy of a checkpoint, or of a safetensors file of training or `pictura export`. Throws Error naming
  /// the file if it is neither of these or is truncated. Throws Error if its observation schema or architecture is not
  /// the current one, or if this device cannot run the policy. Throws UsageError if the policy cannot use the options'
  /// cameras.
  explicit PolicySession(const std::string& path, const SessionOptions& options = {});
  /// Wraps a policy, which must outlive the session, with cameras that are not randomized. Every call uses the current
  /// weights. Builds without torch lack this constructor.
  PolicySession(const Config& config, const Rig& rig, Device device, const Policy& policy);
  explicit PolicySession(std::unique_ptr<SessionParts> parts);
  ~PolicySession();
  /// Returns a session with the same worlds and cameras, and an untrained policy of the same architecture. `seed`
  /// determines its weights as in training, except those of a program (policy.backbone). Throws Error in builds without
  /// torch.
  std::unique_ptr<PolicySession> make_untrained(uint64_t seed) const;
  PolicySession(const PolicySession&) = delete;
  PolicySession& operator=(const PolicySession&) = delete;

  bool reads_images() const;
  const Rig& rig() const;
  double camera_severity() const;
  /// Device of the network, simulators, renderers and all arrays.
  Device device() const;

  /// Cameras, randomization and samples are those of the options. The palette and the minimum width of drawn lines are
  /// those of training.
  RendererConfig renderer_config() const;
  /// Returns a renderer on device(), to which the caller must upload the maps; null if the policy reads no images.
  /// Throws Error if the renderer cannot run on this machine.
  std::unique_ptr<Renderer> make_renderer() const;

  /// Configuration of the worlds of training.
  SimulatorConfig training_world() const;
  /// Configuration of the paper's evaluation: episodes of `steps` steps without early end, with fixed conditioning and
  /// light timings.
  SimulatorConfig evaluation_world(int steps) const;
  const Config& config() const;
  std::string policy_hash() const;

  /// Writes logits [batch, kNumActions] and values [batch]. The size of values_out is the batch size. `renderer` must
  /// have renderer_config() and the scene's maps; it may be null for policies without images. Throws Error naming an
  /// array that does not fit the batch size.
  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out, Span<float> values_out);

  /// Creates a controller for a simulator on device(). It chooses the most likely action (argmax), or draws as in
  /// training (rules/choose_action.h). Each action is held for policy.decision_steps steps, counted from the first
  /// act(). renderer: see evaluate(); it and the session must outlive the controller. hides_auxiliary: see PolicyInput.
  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool hides_auxiliary = false);

 private:
  std::unique_ptr<SessionParts> parts_;
};

}  // namespace pictura
