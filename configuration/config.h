// The single configuration of training and evaluation: its keys, defaults (the paper's tables), reading and writing.
// Each section has a header. docs/reference/configuration.md explains every key; configs/*.toml are examples.
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

  /// Whether the policy reads this part of an observation.
  bool reads(ObservationPart part) const;
  /// Whether the policy reads images.
  bool reads_images() const { return policy.modality == Modality::perspective; }
};

/// Reads a TOML text. `overrides` are "section.key=value" and take precedence; "section.key=" removes the text's value,
/// and "render.rig=..." also removes the text's image sizes. Whole numbers may be written in any decimal notation.
/// run.backend, the old name of simulator.backend and render.backend, sets each of the two that is absent. Throws Error
/// naming source:line and key for unknown keys, wrong types, values out of range, contradictions, and backends that
/// this build does not know, whose names it lists.
Config parse_config(const std::string& text, const std::string& source, const std::vector<std::string>& overrides = {});

/// Reads a configuration that a run saved, possibly with another build: it may name any backend.
Config parse_saved_config(const std::string& text, const std::string& source);

/// Reads a file. Paths of rigs, map files, policy.backbone and train.teacher are relative to their place of definition:
/// paths in the file to its folder, paths in overrides to the caller's folder. In the result, all are relative to the
/// caller's folder.
Config load_config(const std::string& path, const std::vector<std::string>& overrides = {});

/// Returns the configuration with values of [evaluate.conditioning] replaced; each is "name=value". Throws UsageError
/// that names the option --conditioning.
Config with_evaluate_conditioning(const Config& config, const std::vector<std::string>& values);

/// Returns every key with its value, as TOML that parse_config() reads back to an equal Config.
std::string to_toml(const Config& config);

/// Returns names as in a configuration.
std::string name_of(Precision precision);
std::string name_of(OptimizerKind kind);

}  // namespace pictura
