// In what two configurations differ, and whether that matters.
#pragma once

#include <map>
#include <string>
#include <vector>

#include "pictura/configuration/config.h"

namespace pictura {

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

/// The keys that decide what an evaluation counts and that no option of it replaces, with their values as to_toml()
/// writes them: of the worlds, and of the policy where there is one.
std::map<std::string, std::string> keys_of_evaluation(const Config& config, bool has_policy);

}  // namespace pictura
