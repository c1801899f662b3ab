// Comparison of two configurations, and whether their differences matter.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

/// Returns the key and both values of the first differing setting that changes the meaning of a run, or an empty text.
/// Differences are allowed in: when to stop and how often to save; the schedule of the learning rate; the optimizer;
/// the teacher; the average of weights; devices and number of threads, as long as images are drawn by the same rules;
/// the number of transitions in a forward pass; evaluations; the description of cameras and backbones (compare the rigs
/// and the programs' hashes); and all of [render] if the policy reads no images.
std::string first_difference(const Config& saved, const Config& now);

/// Returns the key and both values of the first setting in which two ranks of a run differ, or an empty text. Devices
/// and number of threads may differ.
std::string first_difference_of_ranks(const Config& first, const Config& other);

/// Returns the differing settings that a resumed run may change but should report, as "KEY: OLD became NEW": the
/// schedules of learning rate and image size, the teacher, train.weight_average and train.reproducible. The optimizer
/// is reported with its moments, see RunKeeper::begin().
std::vector<std::string> differences_to_report(const Config& saved, const Config& now);

/// Returns the keys that determine an evaluation's counts and that no option of the evaluation replaces, with their
/// values as written by to_toml(): keys of the worlds, and of the policy if there is one.
std::map<std::string, std::string> keys_of_evaluation(const Config& config, bool has_policy);

}  // namespace pictura
