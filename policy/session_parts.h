// Base class of PolicySession's implementations.
#pragma once

#include <memory>
#include <string>

#include "pictura/configuration/config.h"
#include "pictura/policy/session.h"
#include "pictura/policy/stored_policy.h"

namespace pictura {

struct SessionParts {
  SessionParts(const Config& its_config, Device its_device, const Rig& its_rig, double its_camera_severity)
      : config(its_config), device(its_device), rig(its_rig), camera_severity(its_camera_severity) {}
  virtual ~SessionParts() = default;
  SessionParts(const SessionParts&) = delete;
  SessionParts& operator=(const SessionParts&) = delete;

  /// The following functions implement those of PolicySession.
  virtual std::string policy_hash() const = 0;
  virtual std::unique_ptr<SessionParts> make_untrained(uint64_t seed) const = 0;
  virtual void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out,
                        Span<float> values_out) const = 0;
  virtual std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                            bool hides_auxiliary) const = 0;

  const Config config;
  const Device device;
  const Rig rig;
  const double camera_severity;
  bool observes_vectors = false;  // image policies get vector observations too

 protected:
  /// Throws Error if renderer, scene or views are missing, or do not fit the batch.
  void check_images(const PolicyInput& input, size_t batch, const Renderer* renderer) const;
  /// Throws Error naming the precision if the policy's outputs are not finite.
  void check_outputs(bool are_finite) const;
};

/// Returns the options' rig, else that of training. Other cameras are possible, because no weight depends on them.
/// Throws as PolicySession does.
Rig chosen_rig(const PolicyFacts& saved, const SessionOptions& options);

/// Open a session with torch or with policy/host_network.h. open_host_session() throws Error if the options specify
/// another device than the host, or if policy.backbone is a program.
std::unique_ptr<SessionParts> open_torch_session(const std::string& path, const SessionOptions& options);
std::unique_ptr<SessionParts> open_host_session(const std::string& path, const SessionOptions& options);

}  // namespace pictura
