// Configuration of training and evaluation: its keys, their defaults (from the tables of the paper), reading and
// writing. Each section has its own header. docs/reference/configuration.md explains every key, and configs/*.toml are
// examples.
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

/// Reads a TOML text. `overrides` have the form "section.key=value" and take precedence. "section.key=" removes the key
/// from the TOML text. "render.rig=..." also removes the text's image sizes. Whole numbers may be written in any
/// decimal notation. run.backend is the old name of simulator.backend and render.backend; it sets each of the two keys
/// that is absent. Throws Error, which names source:line and key, for unknown keys, wrong types, values out of range,
/// contradictions, and unknown backends.
Config parse_config(const std::string& text, const std::string& source, const std::vector<std::string>& overrides = {});

/// Reads a configuration that a run saved. It may name any backend, because another build may have saved it.
Config parse_saved_config(const std::string& text, const std::string& source);

/// Reads a file. Relative paths in the file (see visit_paths()) start at the file's folder, and relative paths in
/// overrides start at the caller's folder. In the result, all relative paths start at the caller's folder.
Config load_config(const std::string& path, const std::vector<std::string>& overrides = {});

/// Returns the configuration with replaced values of [evaluate.conditioning]. Each of `values` is "name=value". Throws
/// UsageError, which names the option --conditioning, for an invalid value.
Config with_evaluate_conditioning(const Config& config, const std::vector<std::string>& values);

/// Returns every key with its value as TOML. parse_config() reads an equal Config from it.
std::string to_toml(const Config& config);

/// Return the names that a configuration uses.
std::string name_of(Precision precision);
std::string name_of(OptimizerKind kind);

}  // namespace pictura
