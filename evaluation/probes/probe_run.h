// Shared procedure of all probes: policies drive equal shares of the scenes, and all policies evaluate batches of cases
// from sampled states.
#pragma once

#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "pictura/common/raster/camera.h"
#include "pictura/common/renderer.h"
#include "pictura/common/support/stopwatch.h"
#include "pictura/evaluation/probes/probe_options.h"
#include "pictura/evaluation/probes/probe_results.h"
#include "pictura/policy/learning_device.h"
#include "pictura/policy/session.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

/// Driven worlds at one step, on the host.
struct ProbeFrame {
  std::vector<WorldSpec> worlds;
  int step = 0;    // completed steps
  int driver = 0;  // index of the policy; a controller comes after all policies
  std::vector<AgentStatus> status;
  std::vector<AgentClass> agent_class;
  std::vector<int32_t> lane;
  std::vector<float> speed_mps;
  std::vector<AgentBox> boxes;
  std::vector<LightState> lights;
  std::vector<GeometryHandle> geometry;
  std::vector<View> views;
  std::vector<int32_t> box_begin, light_begin, slot_begin;

  ProbeFrame(Simulator& simulator, int step, int driver);

  int32_t scene_of(size_t world) const {
    return static_cast<int32_t>(worlds[world].global_world - kFirstEvaluationWorld);
  }
  bool is_present(size_t slot) const {
    const AgentStatus its_status = status[slot];
    return its_status == AgentStatus::active || its_status == AgentStatus::halted;
  }
  bool is_ego(size_t slot) const {
    return status[slot] == AgentStatus::active && agent_class[slot] == AgentClass::vehicle;
  }
};

/// Scene on the host. Its worlds may come from frames of different steps.
struct KeptScene {
  std::vector<int32_t> world_begin{0}, light_begin{0}, hidden;
  std::vector<AgentBox> boxes;
  std::vector<GeometryHandle> geometry;
  std::vector<LightState> lights;

  /// Adds a world, then the inserted boxes.
  void add_world(const ProbeFrame& frame, size_t world, Span<const InsertedBox> inserted = {});
  /// Return the index of a box of the last added world: the frame's box `box_of_frame`, or the first inserted box.
  int32_t box_of(const ProbeFrame& frame, size_t world, int32_t box_of_frame) const {
    return box_of_frame - frame.box_begin[world] + world_begin[geometry.size() - 1];
  }
  int32_t first_inserted(const ProbeFrame& frame, size_t world) const {
    return box_of(frame, world, frame.box_begin[world + 1]);
  }
  /// Returns a view of the last added world without the boxes `without`, which are indices in this scene.
  View view_of(const ProbeFrame& frame, size_t world, int32_t slot, const std::vector<int32_t>& without);
};

/// Agent observed in two states. Either the second state lacks hidden_box, or the first contains `inserted`, or the
/// states are equal.
struct ProbePair {
  size_t world = 0;
  int32_t slot = 0;
  int32_t hidden_box = -1;
  std::optional<InsertedBox> inserted;
  int32_t measured_box = -1;  // box whose visibility is measured; -1: none (NaN)
};

/// Cases still to be selected. The numbers of cases per scene differ by at most one. A scene's cases are spread evenly
/// over its sampled steps if each of them offers enough cases.
class CaseQuota {
 public:
  CaseQuota(int64_t cases, const ProbeOptions& options) : cases_(cases), options_(options) {}
  int64_t due(int32_t scene, int step) const;
  void take(int32_t scene, int64_t count) { taken_[scene] += count; }

 private:
  int64_t cases_;
  const ProbeOptions& options_;
  std::map<int32_t, int64_t> taken_;
};

struct ProbeKind {
  // Fresh weights, drawn from the seed, respond as a control. The trained policies still drive.
  bool untrained = false;
};

class ProbeRun final : public EvaluationObserver {
 public:
  /// The sessions are open on one device; options.policies names them. Fills in the results that options and sessions
  /// determine.
  ProbeRun(const std::vector<PolicySession*>& sessions, const ProbeOptions& options, ProbeResults* results_out,
           const ProbeKind& kind);
  ~ProbeRun() override;

  /// Called before every step.
  using Watch = std::function<void(Simulator& simulator, int driver)>;

  /// Drives all scenes, and passes the states to `sample` every sample_steps steps. Returns the visibility of every
  /// pair's measured_box, in the order of add_pairs(). With `watch`, only the driver's simulator runs, and add_pairs()
  /// must not be called.
  std::vector<float> run(const std::function<void(const ProbeFrame&)>& sample, const Watch& watch = {});

  /// Adds pairs of the current frame. Responses are appended to the results in this order.
  void add_pairs(const ProbeFrame& frame, Span<const ProbePair> pairs);

  /// Returns visibilities in the cameras of the first policy that reads images, or in the paper's cameras if no policy
  /// reads images.
  std::vector<float> visibility(const KeptScene& scene, const std::vector<View>& views,
                                const std::vector<VisibilityQuery>& queries);
  /// scene: in the memory of device().
  std::vector<float> visibility(const SceneBatch& scene, const std::vector<View>& views,
                                const std::vector<VisibilityQuery>& queries);
  /// Cameras of visibility().
  const RendererConfig& cameras() const { return cameras_; }
  /// First camera of cameras(), in the ego's frame.
  const PinholeCamera& front_camera() const { return front_camera_; }
  const CompiledMaps& maps() const { return maps_; }
  Renderer& measuring() { return *measuring_; }
  Device device() const { return device_; }
  /// Return the session that responds for a policy (ProbeKind), the policy's renderer (null without images), and the
  /// configuration of the policy's observations.
  PolicySession& session(size_t policy) const;
  Renderer* renderer(size_t policy) const;
  SimulatorConfig world_of(size_t policy) const;

  void begin(Simulator& simulator) override;
  void before_step(Span<const Command> commands) override;

 private:
  struct ObservedWorlds;
  struct Participant;
  struct Pending;

  template <typename F>
  void for_each_other(const F& f);
  EvaluateOptions share_of_driver(int shares);
  void drive();
  void drive_by_controller();
  void add(const ProbeFrame& frame, Span<const ProbePair> pairs);
  void evaluate_pending();

  const ProbeOptions& options_;
  const Device device_;
  const int pass_;
  int64_t batch_ = 0;
  const Stopwatch since_start_;
  CompiledMaps maps_;
  std::map<bool, std::unique_ptr<ObservedWorlds>> observed_;  // key: auxiliary slots are filled
  std::vector<Participant> participants_;
  RendererConfig cameras_;
  PinholeCamera front_camera_;
  std::unique_ptr<Renderer> measuring_;
  std::function<void(const ProbeFrame&)> sample_;
  Watch watch_;
  Simulator* driven_ = nullptr;
  int driver_ = 0, step_ = 0;
  std::unique_ptr<Pending> pending_;
  std::vector<float> visible_shares_;
  ProbeResults& results_;
};

/// Throws UsageError if the number of scenes is not a multiple of the number of policies, or nothing is sampled.
void check_probe(const ProbeOptions& options, size_t num_policies);

std::unique_ptr<PolicySession> open_policy(const ProbeOptions& options, size_t policy);

/// Opens options.policies for `probe`.
template <typename Results, typename Options>
Results with_opened(Options options,
                    Results (*probe)(const std::vector<PolicySession*>& sessions, const Options& options)) {
  EvaluateOptions& worlds = options.worlds;
  if (worlds.scenarios == 0) worlds.scenarios = default_probe_scenes(options.policies.size(), worlds.maps.size());
  check_probe(options, options.policies.size());
  std::vector<std::unique_ptr<PolicySession>> opened;
  std::vector<PolicySession*> sessions;
  for (size_t policy = 0; policy < options.policies.size(); ++policy) {
    opened.push_back(open_policy(options, policy));
    sessions.push_back(opened.back().get());
  }
  return probe(sessions, options);
}

}  // namespace pictura
