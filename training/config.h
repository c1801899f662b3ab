// The one configuration of training and evaluation: what it may say, its defaults (the paper's tables), its reading and
// its writing. docs/configuration.md explains every key; configs/*.toml are examples.
#pragma once

#include <array>
#include <string>
#include <vector>

#include "pictura/common/camera.h"
#include "pictura/common/renderer.h"
#include "pictura/simulator/simulator.h"

namespace pictura {

enum class Modality { perspective, vector };

/// Of the network on a CUDA device: IEEE fp32; products in TF32; layers in bf16. See training/precision.h.
enum class Precision { fp32, tf32, bf16 };

/// What becomes of agents that are halted or absent: they are neither drawn nor encoded; or they are, in rollouts and
/// updates, and nothing is learnt from them.
enum class HaltedSlots { skip, draw };

/// How the learning rate falls to 0, or not.
enum class Schedule { constant, linear, cosine };

/// What steps the parameters: see training/optimizer.h.
enum class OptimizerKind { adamw, muon };

/// What the critic's head predicts, see training/value_head.h: values; their symlog; or how probable each of a row of
/// values is.
enum class ValueHead { linear, symlog, two_hot };

/// What the advantage filter's threshold follows, see training/rules/advantage_filter.h: a fraction of the largest
/// |advantage|, or a quantile of them.
enum class FilterThreshold { maximum, quantile };

/// Largest side of a policy's patches that a configuration may have.
constexpr int kMaxPatch_px = 16;

struct Config {
  struct Run {
    uint64_t seed = 1;            // names the whole run
    int num_threads = 0;          // of simulator, renderer and torch; 0: all
    std::string device = "auto";  // what learns: cpu, cuda, cuda:N or auto
  } run;

  struct SimulatorSection {
    std::string backend = "auto";  // cpu, cuda or auto
    std::vector<std::string> maps{"Town01", "Town02", "Town03", "Town04", "Town05", "Town06", "Town07", "Town10HD"};
    int map_copies = 0;                    // affine copies of each map, beside it
    int num_slots = 20480;                 // concurrent agents, over all worlds
    int min_agents = 1, max_agents = 120;  // agents per world ~ U{min, max}
    int episode_steps = 1280;
    double reset_inactive_fraction = 0.4;  // a world resets when this part of its agents is inactive
    double pedestrian_fraction = 0.1, cyclist_fraction = 0.1;
    int parked_cars = 32;  // per episode and world
    LightCycles light_cycles = LightCycles::phases;
    bool walls = true;
    uint64_t wall_seed = 0;
    LightHeads light_heads = LightHeads::as_mapped;
    bool wall_observations = false;  // the vector policy also reads the set of walls
    DynamicsRules dynamics;          // [simulator.dynamics]
    /// Training distributions: [simulator.conditioning] NAME = [low, high]; see simulator/conditioning.h for the names.
    std::array<ConditioningRange, kNumConditioning> conditioning = SimulatorConfig::default_conditioning();
  } simulator;

  struct Render {
    std::string backend = "auto";       // as make_renderer takes it
    PixelSamples samples;               // of gl; the others compute exact coverage
    std::string rig;                    // a rig file (docs/image.md)
    int width_px = 96, height_px = 54;  // without one: of each camera of the paper's rig
    /// Other sizes, each from so many agent-steps of the run on, in ascending order; not with a rig file. Where
    /// patch_px is not 0, policy.patch_px and line_floor_px are these from then on, and the first convolution is spread
    /// over the larger patches (training/patch_spread.h).
    struct SizeChange {
      int64_t agent_steps = 0;
      int width_px = 0, height_px = 0;
      int patch_px = 0;  // 0: patches and line floor stay
      double line_floor_px = 0;
      bool has_patches() const { return patch_px > 0; }
    };
    std::vector<SizeChange> schedule;
    double line_floor_px = 0.35;  // least width of a line on screen
  } render;

  struct PolicySection {
    Modality modality = Modality::perspective;
    bool auxiliary = false;  // vector: fill the slots that no camera could (the paper's Vectorized)
    int patch_px = 4;        // space to depth: a patch of so many pixels squared becomes one with as many channels
    std::vector<int> conv_channels{64, 64, 128, 128, 128};
    std::vector<int> conv_kernels{1, 3, 3, 3, 3};
    std::vector<int> conv_strides{1, 1, 2, 1, 1};
    int num_queries = 16;  // learned queries per camera
    int attention_heads = 4;
    int attention_mlp = 256;        // hidden width of the block's MLP; 0: none
    int embedding_width = 64;       // of every group
    bool point_features = true;     // encoders read points near the agent apart, see training/row_features.h
    bool segment_features = false;  // vector: encoders read the agent's place beside lanes, boundaries and walls
    bool goal_features = false;     // vector: encoders read the distance of lanes to the goal
    /// "conv": the convolutions; or the path of a program of scripts/export_backbone, relative to the configuration's
    /// folder.
    std::string backbone = "conv";
    bool backbone_frozen = true;  // the program's weights stay as they are
    int backbone_layers = 4, backbone_width = 512;
    int critic_layers = 0;  // of a trunk that the critic has for itself; 0: it shares the actor's
    ValueHead value_head = ValueHead::linear;
    bool layer_norm = false;  // layers of groups and trunk are normalized, see docs/network.md
    bool residual = false;    // every layer of the trunk but the first adds its input
    int decision_steps = 1;   // steps for which an action is held, see training/decision_clock.h
  } policy;

  struct Train {
    int64_t updates = 19074;  // when to stop
    // The learning rate, see training/schedule.h.
    Schedule schedule = Schedule::cosine;
    int64_t schedule_agent_steps = 50'000'000'000;
    int64_t decay_agent_steps = 0;  // 0: all of them
    int64_t warm_up_agent_steps = 0;
    int num_steps = 128;            // steps of a rollout
    bool stagger_episodes = false;  // the worlds' first episodes end at different times, see max_steps_of()
    int64_t minibatch_size = 65536;
    int update_epochs = 2;
    int64_t forward_chunk = 2048;  // transitions that go through the network at once; gradients accumulate
    double gamma = 0.999, gae_lambda = 0.95;
    double clip_coef = 0.2;
    double vf_coef = 0.5, ent_coef = 0.01;
    OptimizerKind optimizer = OptimizerKind::adamw;
    double learning_rate = 5e-4;
    double adam_beta1 = 0.9, adam_beta2 = 0.999, adam_eps = 1e-8, weight_decay = 0.01;
    double max_grad_norm = 0.5;
    double weight_average =
        0;  // half-life in updates of the average of weights, see training/weight_average.h; 0: none
    int64_t sharpen_agent_steps = 0;  // over so many the policy's logits double, see training/schedule.h; 0: never
    /// A saved vector policy to imitate, see training/teacher.h: the loss has the KL divergence from its actions times
    /// teacher_coef, which falls to 0 along a line over so many agent-steps. Relative to the configuration's folder.
    std::string teacher;
    double teacher_coef = 1;
    int64_t teacher_agent_steps = 100'000'000;
    bool norm_adv = true;  // per minibatch
    FilterThreshold adv_filter = FilterThreshold::maximum;
    double adv_filter_threshold = 0.01;  // maximum: of the running max |advantage|; 0: keep everything
    double adv_filter_quantile = 0.5;    // quantile: share of the valid transitions that is dropped
    double adv_filter_ema = 0.25;        // weight of the newest rollout in the running max or quantile
    int64_t checkpoint_every = 20;       // updates
    double checkpoint_minutes = 2;       // or as soon as these have passed
    int64_t keep_checkpoints = 1;        // the newest and those before it, as checkpoint.1.ckpt, ...
    int64_t milestone_agent_steps = 0;   // distance of checkpoints that are kept for ever; 0: none
    // Small evaluations within a run, see training/run_evaluation.h.
    int64_t evaluate_every = 0;  // updates; 0: never
    int evaluate_scenarios = 16, evaluate_agents = 120, evaluate_steps = 600;
    Precision precision = Precision::bf16;
    bool reproducible = false;  // the same bits in every run on a device, see training/precision.h
    /// Of a rollout: kept, or redrawn from its scenes where they are read; auto: kept on the host,
    /// and on a device where they take at most a quarter of its memory.
    std::string images = "auto";
    std::string graphs = "auto";                   // CUDA graphs of a learner's work; off: call by call
    HaltedSlots halted_slots = HaltedSlots::skip;  // draw: for measuring alone, with every slot at every step
  } train;

  struct Evaluate {
    /// What every agent is conditioned on: [evaluate.conditioning] NAME = value.
    std::array<double, kNumConditioning> conditioning = default_conditioning();
    static std::array<double, kNumConditioning> default_conditioning();
  } evaluate;

  /// Whether the policy reads such arrays of an observation.
  bool reads(ObservationPart part) const;
  /// Whether it reads images.
  bool reads_images() const { return policy.modality == Modality::perspective; }
};

/// Reads a TOML text. `overrides` are "section.key=value" and win; "section.key=" unsets what the text says, and
/// "render.rig=..." its sizes of images. Whole numbers may be written in any decimal notation. run.backend, the old
/// name of simulator.backend and render.backend, fills in whichever of the two is absent. Throws Error naming
/// source:line and key for unknown keys, wrong types, values out of range, contradictions, and backends that this build
/// does not know, whose names it lists.
Config parse_config(const std::string& text, const std::string& source, const std::vector<std::string>& overrides = {});

/// Reads what a run saved, perhaps with another build: its backends may be any.
Config parse_saved_config(const std::string& text, const std::string& source);

/// Reads a file. Paths of rigs, map files, policy.backbone and train.teacher are relative to where they are typed:
/// those in the file to its folder, those of overrides to the caller's. In the result, all are relative to the
/// caller's.
Config load_config(const std::string& path, const std::vector<std::string>& overrides = {});

/// The configuration with values of [evaluate.conditioning] replaced; each is "name=value". Throws UsageError that
/// names the option --conditioning.
Config with_evaluate_conditioning(const Config& config, const std::vector<std::string>& values);

/// Every key with its value, as TOML that parse_config reads back to an equal Config.
std::string to_toml(const Config& config);

/// Key of the first setting that changes what a run means and in which the two differ, with both values, or empty. What
/// may differ: when to stop and how often to save; the schedule of the learning rate; the optimizer; the teacher; the
/// average of weights; where and on how many threads it runs, as long as images are drawn by the same rules; how many
/// transitions go through the network at once; what is evaluated; how cameras and backbones are described (compare the
/// rigs and the programs' hashes), and all of [render] where the policy reads no images.
std::string first_difference(const Config& saved, const Config& now);

/// Key of the first setting in which two ranks of a run differ, with both values, or empty. Where each runs, and on how
/// many threads, may differ.
std::string first_difference_of_ranks(const Config& first, const Config& other);

/// The settings in which the two differ of those that a run that goes on may change and should report, the schedules of
/// learning rate and image size, the teacher, train.weight_average and train.reproducible, as "KEY: OLD became NEW".
/// The optimizer is reported with its moments, see RunKeeper::begin().
std::vector<std::string> differences_to_report(const Config& saved, const Config& now);

/// Names as in a configuration.
std::string name_of(Precision precision);
std::string name_of(OptimizerKind kind);
std::string name_of(ValueHead head);

/// The configuration in force after `agent_steps`: sizes, policy.patch_px and render.line_floor_px are those of
/// render.schedule.
Config config_at(const Config& config, int64_t agent_steps);

/// How many times as wide and as high as `from` the size `to` is, where that is one whole number, else 0.
int whole_factor(ImageSize from, ImageSize to);

/// The rig that render describes for a run that has done `agent_steps`.
Rig rig_of(const Config& config, int64_t agent_steps = 0);

/// What the renderer is told: everything about an image that the policy depends on, with a rig of its run. `device` is
/// where the network computes.
RendererConfig renderer_config(const Config& config, const Rig& rig, Device device = {});

/// What the simulator is told for training: entity sets only for the vector modality.
SimulatorConfig simulator_config(const Config& config, Device device = {});

/// The same for evaluation (paper, appendix, evaluation protocol): episodes of `steps` that nothing ends early, fixed
/// conditioning, fixed lights.
SimulatorConfig evaluation_simulator_config(const Config& config, int steps, Device device = {});

}  // namespace pictura
