// Sessions in which the host computes the policy without torch.
#include <algorithm>
#include <cmath>
#include <utility>

#include "pictura/backends/make_policy_executor.h"
#include "pictura/common/error.h"
#include "pictura/common/image.h"
#include "pictura/policy/host_network.h"
#include "pictura/policy/host_passes.h"
#include "pictura/policy/learning_device.h"
#include "pictura/policy/network_shape.h"
#include "pictura/policy/session_parts.h"
#include "pictura/simulator/actions.h"
#include "pictura/simulator/controllers/host_controllers.h"
#include "pictura/simulator/observation_arrays.h"

namespace pictura {

namespace {

// Observation arrays of selected agents.
class GatheredRows {
 public:
  /// Throws Error, which names the array, if the size of an array that the policy reads is not that of `batch` agents.
  GatheredRows(const Config& config, const ObservationView& all, int64_t batch, Span<const int64_t> indices) {
#define X(name, type, rows, features, part, comment)                                                           \
  if (config.reads(part)) {                                                                                    \
    constexpr int64_t kOfOne = int64_t{rows} * (features);                                                     \
    PICTURA_CHECK(all.name.size() == static_cast<size_t>(batch * kOfOne),                                      \
                  "observation: {}: expected {} numbers, for {} agents, got {}", #name, batch * kOfOne, batch, \
                  all.name.size());                                                                            \
    for (const int64_t i : indices) {                                                                          \
      name##_.insert(name##_.end(), all.name.data() + i * kOfOne, all.name.data() + (i + 1) * kOfOne);         \
    }                                                                                                          \
    view.name = name##_;                                                                                       \
  }
    PICTURA_OBSERVATION_ARRAYS(X)
#undef X
  }

  /// Sets all auxiliary features to zero (see simulator/observation.h), as if the simulator did not observe them.
  void hide_auxiliary() {
    for (size_t i = 0; i < ego_.size(); ++i) ego_[i] = i % kEgoFeatures < kSeenEgoFeatures ? ego_[i] : 0;
    for (size_t i = 0; i < partners_.size(); ++i) {
      partners_[i] = i % kPartnerFeatures < kSeenPartnerFeatures ? partners_[i] : 0;
    }
  }

  ObservationView view;

 private:
#define X(name, type, rows, features, part, comment) std::vector<type> name##_;
  PICTURA_OBSERVATION_ARRAYS(X)
#undef X
};

struct HostSession final : SessionParts {
  HostSession(const StoredPolicy& saved, const Config& its_config, const Rig& its_rig, double its_camera_severity)
      : SessionParts(its_config, Device{}, its_rig, its_camera_severity),
        executor(make_policy_executor(device)),
        network(saved, static_cast<int>(its_rig.cameras.size())),
        hash(hash_of_parameters(saved.parameters)) {}

  std::string policy_hash() const override { return hash; }

  std::unique_ptr<SessionParts> make_untrained(uint64_t /*seed*/) const override {
    fail("policy: drawing weights as training does needs torch, which this build lacks: pip install pictura[train]");
  }

  void evaluate(const PolicyInput& input, Renderer* renderer, Span<float> logits_out,
                Span<float> values_out) const override {
    std::vector<int64_t> all(values_out.size());
    for (size_t i = 0; i < all.size(); ++i) all[i] = static_cast<int64_t>(i);
    decide(input, static_cast<int64_t>(all.size()), all, renderer, logits_out.data(), values_out.data());
  }

  std::unique_ptr<PolicyController> make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                    bool hides_auxiliary) const override;

  /// Writes logits and values of the agents of a batch at `indices`. The result of an agent does not depend on the
  /// other agents, so PolicyInput::full_chunk has no effect.
  void decide(const PolicyInput& input, int64_t batch, Span<const int64_t> indices, Renderer* renderer,
              float* logits_out, float* values_out) const {
    if (config.reads_images()) check_images(input, static_cast<size_t>(batch), renderer);
    constexpr int64_t kMaxAtOnce = 512;  // agents; at the paper's image size, the images of an agent take 62 KB
    const auto total = static_cast<int64_t>(indices.size());
    const int64_t max_agents = std::min<int64_t>(config.train.forward_chunk, kMaxAtOnce);
    for (int64_t begin = 0; begin < total; begin += max_agents) {
      const auto some =
          indices.subspan(static_cast<size_t>(begin), static_cast<size_t>(std::min(max_agents, total - begin)));
      GatheredRows rows(config, input.observations, batch, some);
      if (input.hides_auxiliary) rows.hide_auxiliary();
      HostObservation observation{static_cast<int64_t>(some.size()), rows.view, {}};
      const std::vector<uint8_t> pixels =
          config.reads_images() ? draw(input, some, renderer, &observation.images) : std::vector<uint8_t>();
      network.forward(observation, config.run.num_threads, logits_out + begin * kNumActions, values_out + begin);
    }
    const auto are_finite = [](const float* values, int64_t count) {
      return std::all_of(values, values + count, [](float value) { return std::isfinite(value); });
    };
    check_outputs(are_finite(logits_out, total * kNumActions) && are_finite(values_out, total));
  }

  const std::unique_ptr<PolicyExecutor> executor;

 private:
  // Returns the pixels of the agents' images. *blocks_out gets pointers to them. Images of agents that are not drawn
  // are black.
  std::vector<uint8_t> draw(const PolicyInput& input, Span<const int64_t> indices, Renderer* renderer,
                            std::vector<HostImageBlock>* blocks_out) const {
    const auto num_views = static_cast<int64_t>(indices.size());
    const ImageLayout layout = image_layout(rig, num_views, PixelFormat::u8);
    std::vector<uint8_t> pixels(layout.bytes());
    // Blocks are stored one after the other; within a block, the images of an agent are adjacent.
    std::vector<uint8_t*> begins;
    uint8_t* next = pixels.data();
    for (const BlockLayout& block : layout.blocks) {
      const auto cameras = static_cast<int64_t>(block.cameras.size());
      begins.push_back(next);
      blocks_out->push_back(
          {next, block.size.height_px, block.size.width_px, {block.cameras.begin(), block.cameras.end()}});
      next += num_views * cameras * 3 * block.size.pixels();
    }
    std::vector<View> views;
    std::vector<int64_t> places;  // index of the agent of each view
    for (int64_t i = 0; i < num_views; ++i) {
      if (!input.is_drawn.empty() && !input.is_drawn[indices[i]]) continue;
      views.push_back(input.views[indices[i]]);
      places.push_back(i);
    }
    if (views.empty()) return pixels;
    // The renderer draws the images contiguously. Then they are moved to the positions of their agents, the last image
    // first.
    std::vector<CameraImages> cameras;
    std::vector<int64_t> num_placed(layout.blocks.size());
    for (const CameraLayout& camera : layout.cameras) {
      const BlockLayout& block = layout.blocks[camera.block];
      const int64_t of_image = 3 * block.size.pixels();
      uint8_t* const first = begins[camera.block] + num_placed[camera.block]++ * of_image;
      cameras.push_back(
          {camera.size.width_px, camera.size.height_px, first, of_image * static_cast<int64_t>(block.cameras.size())});
    }
    renderer->render(*input.scene, views, {device, PixelFormat::u8, static_cast<int>(views.size()), cameras});
    for (const HostImageBlock& block : *blocks_out) {
      const int64_t of_agent = static_cast<int64_t>(block.cameras.size()) * 3 * block.height_px * block.width_px;
      uint8_t* const first = pixels.data() + (block.pixels - pixels.data());
      for (size_t i = places.size(); i-- > 0;) {
        const auto from = static_cast<int64_t>(i), to = places[i];
        if (to == from) break;
        std::copy_n(first + from * of_agent, of_agent, first + to * of_agent);
        std::fill_n(first + from * of_agent, of_agent, uint8_t{0});
      }
    }
    return pixels;
  }

  HostNetwork network;
  std::string hash;
};

/// Controller of one simulator.
class HostController final : public PolicyController {
 public:
  HostController(const HostSession* session, Renderer* renderer, const ActionChoice& choice, bool hides_auxiliary)
      : session_(*session), renderer_(renderer), choice_(choice), hides_auxiliary_(hides_auxiliary) {}

  std::string_view name() const override { return "policy"; }

  void act(const SimulatorArrays& input, Span<const uint8_t> mask, Span<Command> commands_out, Stream) override {
    check_controller_arrays(name(), input, session_.device, mask, commands_out);
    actions_.resize(commands_out.size());
    std::vector<int64_t> slots(commands_out.size());
    slots.resize(static_cast<size_t>(session_.executor->select_deciding({input.state.status, mask, nullptr}, slots)));
    num_driven_ = static_cast<int64_t>(slots.size());
    keep_deciding(input, &slots);
    std::vector<float> logits(slots.size() * kNumActions), values(slots.size());
    session_.decide({.observations = input.observations,
                     .scene = &input.scene,
                     .views = input.views,
                     .hides_auxiliary = hides_auxiliary_},
                    static_cast<int64_t>(commands_out.size()), slots, renderer_, logits.data(), values.data());
    host::log_softmax(logits.data(), static_cast<int64_t>(slots.size()), kNumActions, logits.data());
    session_.executor->choose_actions(input, slots, logits, choice_, actions_);
    session_.executor->write_commands(actions_, mask, commands_out);
  }

  int64_t num_driven() const override { return num_driven_; }

 private:
  // Removes the slots of agents that hold their action, as DecisionClock does.
  void keep_deciding(const SimulatorArrays& input, std::vector<int64_t>* slots_inout) {
    const int64_t decision_steps = session_.config.policy.decision_steps, step = step_++;
    if (decision_steps == 1) return;
    const std::vector<uint8_t> acted_before = std::exchange(acted_, std::vector<uint8_t>(actions_.size()));
    for (const int64_t slot : *slots_inout) acted_[slot] = 1;
    if (all_decide(step, decision_steps, acted_before.size(), acted_.size())) return;
    const HeldActions held(input, acted_before.data(), /*decides_at_end=*/false);
    std::erase_if(*slots_inout, [&](int64_t slot) { return held.holds(slot); });
  }

  const HostSession& session_;
  Renderer* renderer_;
  ActionChoice choice_;
  bool hides_auxiliary_;
  int64_t step_ = 0;              // number of calls of act()
  std::vector<int32_t> actions_;  // [slots] actions that agents hold until their next decision
  std::vector<uint8_t> acted_;    // [slots] whether the agent was active at the previous step
  int64_t num_driven_ = 0;
};

std::unique_ptr<PolicyController> HostSession::make_controller(Renderer* renderer, bool argmax, uint64_t seed,
                                                               bool hides_auxiliary) const {
  return std::make_unique<HostController>(this, renderer, ActionChoice{argmax, seed}, hides_auxiliary);
}

}  // namespace

std::unique_ptr<SessionParts> open_host_session(const std::string& path, const SessionOptions& options) {
  const StoredPolicy saved = read_stored_policy(path, options.average);
  const Config config = with_session_options(saved.config, options);
  PICTURA_CHECK(config.policy.backbone == saved.config.policy.backbone,
                "{}: policy.backbone: expected \"{}\", as in training, got \"{}\"", path, saved.config.policy.backbone,
                config.policy.backbone);
  const Device device = open_learning_device(config);
  PICTURA_CHECK(device.is_host(), "{}: {}: expected the host", path, name_of(device));
  return std::make_unique<HostSession>(saved, config, chosen_rig(saved, options), options.camera_severity);
}

}  // namespace pictura
