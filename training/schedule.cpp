#include "pictura/training/schedule.h"

#include <algorithm>
#include <cmath>
#include <numbers>

namespace pictura {

double learning_rate_at(const TrainSection& config, int64_t agent_steps) {
  const auto done = static_cast<double>(agent_steps);
  double rate = config.learning_rate;
  if (config.warm_up_agent_steps > 0) {
    constexpr double kFirst = 0.1;
    rate *= kFirst + (1 - kFirst) * std::min(1.0, done / static_cast<double>(config.warm_up_agent_steps));
  }
  if (config.schedule == Schedule::constant) return rate;
  const auto end = static_cast<double>(config.schedule_agent_steps);
  const double length = config.decay_agent_steps > 0 ? static_cast<double>(config.decay_agent_steps) : end;
  const double fallen = std::clamp((done - (end - length)) / length, 0.0, 1.0);
  return rate * (config.schedule == Schedule::linear ? 1 - fallen : 0.5 * (1 + std::cos(std::numbers::pi * fallen)));
}

bool schedule_has_ended(const TrainSection& config, int64_t agent_steps) {
  return config.schedule != Schedule::constant && agent_steps >= config.schedule_agent_steps;
}

double logit_growth(const TrainSection& config, int64_t agent_steps) {
  if (config.sharpen_agent_steps == 0) return 1;
  return std::exp2(static_cast<double>(agent_steps) / static_cast<double>(config.sharpen_agent_steps));
}

double teacher_weight_at(const TrainSection& config, int64_t agent_steps) {
  if (config.teacher.empty()) return 0;
  const double done = static_cast<double>(agent_steps) / static_cast<double>(config.teacher_agent_steps);
  return config.teacher_coef * std::max(0.0, 1 - done);
}

}  // namespace pictura
