// Configuration of training and evaluation. docs/reference/configuration.md explains every key, and configs/*.toml are
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

  bool reads(ObservationPart part) const;
  bool reads_images() const { return policy.modality == Modality::perspective; }
};

/// Reads a TOML text. `overrides` have the form "section.key=value" and take precedence. "section.key=" removes a key
/// of the text. "render.rig=..." also removes the text's image sizes. run.backend is the old name of simulator.backend
/// and render.backend, and sets those that are absent. Throws Error, which names source:line and key, for any invalid
/// key or value.
Config parse_config(const std::string& text, const std::string& source, const std::vector<std::string>& overrides = {});

/// Reads a configuration that a run, possibly of another build, saved. It may name any backend.
Config parse_saved_config(const std::string& text, const std::string& source);

/// Reads a file. In the file, relative paths (see visit_paths()) start at the file's folder. In overrides and in the
/// result, they start at the caller's folder.
Config load_config(const std::string& path, const std::vector<std::string>& overrides = {});

/// Returns the configuration with other values of [evaluate.conditioning], each given as "name=value". Throws
/// UsageError, which names the option --conditioning, for an invalid value.
Config with_evaluate_conditioning(const Config& config, const std::vector<std::string>& values);

/// Returns all keys and values as TOML. parse_config() reads an equal Config from it.
std::string to_toml(const Config& config);

/// Names in configurations.
std::string name_of(Precision precision);
std::string name_of(OptimizerKind kind);

}  // namespace pictura
