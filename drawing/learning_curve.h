// The learning curve of a training run as a picture.
#pragma once

#include <string>

namespace pictura {

/// Draws progress.csv of a run's folder into learning_curve.png there: return, goals per km and rates over agent-steps.
/// Returns the picture's path, or nothing where the file has no rows yet. Throws Error naming the file and line.
std::string draw_learning_curve(const std::string& run_folder);

}  // namespace pictura
