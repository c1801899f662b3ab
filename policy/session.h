// A saved policy: what it makes of scenes and observations, and everything about its images and its world that it was
// trained with. Without torch headers.
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

/// The settings of training with what the options change. Those of devices are of the machine that trained it: here
/// whatever draws the same images will do.
Config adapted(const Config& trained, const SessionOptions& options);

/// What a batch of agents sees, in the memory of the session's device.
struct PolicyInput {
  ObservationView observations;       // [batch]; arrays that the policy does not read may be empty
  const SceneBatch* scene = nullptr;  // with views, for a policy that reads images
  Span<const View> views;             // [batch]
  Span<const uint8_t> is_drawn;       // [batch] 0: its images are black; empty: all are drawn
  // > 0: so many agents go through the network at once, always, so that what comes out for one depends on its place
  // among them and not on the batch. 0: at most train.forward_chunk, in equal parts of the batch.
  int64_t full_chunk = 0;
  // Zeros instead of what the auxiliary slots hold, for a policy that was trained without them.
  bool hides_auxiliary = false;
};

/// A policy that drives. On a device act() waits for how many agents it drives, and how many of these decide.
class PolicyController : public Controller {
 public:
  /// How many agents the last act() commanded: those of its mask that were active.
  virtual int64_t num_driven() const = 0;
};

/// Returns the cameras that the options name; nullopt where they name none. Throws UsageError where they name both a
/// rig file and a size, Error as load_rig().
std::optional<Rig> named_rig(const SessionOptions& options);

/// Returns renderer_config() of a configuration for evaluations, in which all policies see through the same cameras of
/// a world.
RendererConfig evaluation_renderer_config(const Config& config, const Rig& rig, Device device);

/// Serves one thread at a time.
class PolicySession {
 public:
  /// The policy of a checkpoint, or of safetensors that training or `pictura export` wrote. Throws Error naming the
  /// file when it is neither, truncated, of another observation schema or architecture, or when it cannot run on this
  /// device. UsageError where it cannot see through the cameras of the options.
  explicit PolicySession(const std::string& path, const SessionOptions& options = {});
  /// The policy of a configuration with cameras of `rig`, as it is when it is asked; it must outlive the session. Its
  /// cameras are not randomized.
  PolicySession(const Config& config, const Rig& rig, Device device, const Policy& policy);
  ~PolicySession();
  /// The same policy as it is before training, in the same worlds and with the same cameras: weights are drawn from
  /// `seed` as train draws them, but for those of a backbone's program.
  std::unique_ptr<PolicySession> untrained(uint64_t seed) const;
  PolicySession(const PolicySession&) = delete;
  PolicySession& operator=(const PolicySession&) = delete;

  bool reads_images() const;
  const Rig& rig() const;
  /// By how much its cameras are randomized: the options' camera_severity.
  double camera_severity() const;
  /// Where it computes. Simulators, renderers and all arrays that it is given work there too.
  Device device() const;

  /// What its images are drawn with: rig, line floor, palette and samples of training, and cameras that are mounted as
  /// the options say.
  RendererConfig renderer_config() const;
  /// A renderer for its images, in the memory of device(); the caller uploads the maps. Null where it reads no images.
  /// Throws Error when the renderer cannot run here.
  std::unique_ptr<Renderer> make_renderer() const;

  /// The world that it was trained in: walls and their seed, population, conditioning, episodes, and the observations
  /// that it reads.
  SimulatorConfig training_world() const;
  /// The same for the paper's evaluation: episodes of `steps` that nothing ends early, fixed conditioning and lights.
  SimulatorConfig evaluation_world(int steps) const;
  /// That it was trained with, with what the options changed.
  const Config& config() const;
  /// Of its weights.
  std::string policy_hash() const;

  /// Writes logits [batch, kNumActions] and values [batch]. `renderer` holds the scene's maps under the handles that
  /// the scene names, and has renderer_config(); policies without images need none. Throws Error naming the array where
  /// a size does not fit the batch, which is that of values_out.
  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out, Span<float> values_out);

  /// Drives in a simulator on device(): the most likely action, or a draw keyed by (seed, global world, agent,
  /// episode, step) as in training. Actions are held for the steps that the policy was trained with (policy.
  /// decision_steps), counted from the first act(). Session and renderer, which is as for evaluate(), must outlive it.
  /// Images are drawn for agents that decide alone. hides_auxiliary: as PolicyInput's.
  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool hides_auxiliary = false);

 private:
  friend class SessionController;
  struct Parts;
  explicit PolicySession(std::unique_ptr<Parts> parts);
  std::unique_ptr<Parts> parts_;
};

}  // namespace pictura
