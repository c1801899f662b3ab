// The one configuration of training and evaluation: what it may say, its defaults (the paper's tables), its reading and
// its writing. A header a section. docs/reference/configuration.md explains every key; configs/*.toml are examples.
#pragma once

#include <string>
#include <vector>

#include "pictura/common/error.h"
#include "pictura/configuration/evaluate_section.h"
#include "pictura/configuration/policy_section.h"
#include "pictura/configuration/render_section.h"
#include "pictura/configuration/run_section.h"
#include "pictura/configuration/simulator_section.h"
#include "pictura/configuration/train_section.h"
#include "pictura/simulator/observation.h"

namespace pictura {

struct Config {
  RunSection run;
  SimulatorSection simulator;
  RenderSection render;
  PolicySection policy;
  TrainSection train;
  EvaluateSection evaluate;

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

/// Names as in a configuration.
std::string name_of(Precision precision);
std::string name_of(OptimizerKind kind);

}  // namespace pictura
