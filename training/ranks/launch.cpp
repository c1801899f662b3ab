#include "pictura/training/ranks/launch.h"

#include <charconv>
#include <cstdlib>
#include <optional>

#include "pictura/common/error.h"

namespace pictura {

namespace {

std::optional<std::string> variable(const char* name) {
  const char* const text = std::getenv(name);
  return text && *text ? std::optional<std::string>(text) : std::nullopt;
}

// Returns the value of a variable that is an integer in [low, high]; `absent` if the variable is not set.
std::optional<int> integer(const char* name, int low, int high, std::optional<int> absent = std::nullopt) {
  const std::optional<std::string> text = variable(name);
  if (!text) return absent;
  int value = 0;
  const auto [end, error] = std::from_chars(text->data(), text->data() + text->size(), value);
  PICTURA_CHECK(error == std::errc{} && end == text->data() + text->size() && value >= low && value <= high,
                "{}: expected an integer in [{}, {}], got '{}'", name, low, high, *text);
  return value;
}

constexpr int kMaxRanks = 1 << 16;

// Names of the variables in which a launcher passes a process its place.
struct Names {
  const char *rank, *size, *local_rank;
};
constexpr Names kTorchrun{"RANK", "WORLD_SIZE", "LOCAL_RANK"};
// Only srun sets SLURM_STEP_NUM_TASKS; a batch script without srun is a single process.
constexpr Names kSlurm{"SLURM_PROCID", "SLURM_STEP_NUM_TASKS", "SLURM_LOCALID"};

Launch place_by(const Names& names) {
  Launch launch;
  const std::optional<int> size = integer(names.size, 1, kMaxRanks);
  PICTURA_CHECK(size, "{} is set but {} is not: set both or neither", names.rank, names.size);
  launch.size = *size;
  const std::optional<int> rank = integer(names.rank, 0, launch.size - 1);
  PICTURA_CHECK(rank, "{} is set but {} is not: set both or neither", names.size, names.rank);
  launch.rank = *rank;
  launch.local_rank = *integer(names.local_rank, 0, kMaxRanks - 1, launch.rank);
  return launch;
}

}  // namespace

std::string first_slurm_host(const std::string& list) {
  const size_t bracket = list.find('['), comma = list.find(',');
  if (bracket == std::string::npos || comma < bracket) return list.substr(0, comma);
  const size_t end = list.find_first_of("-,]", bracket);
  return list.substr(0, bracket) + list.substr(bracket + 1, end - bracket - 1);
}

Launch launch_from_environment() {
  Launch launch;
  if (variable(kTorchrun.rank) || variable(kTorchrun.size)) {
    launch = place_by(kTorchrun);
  } else if (variable(kSlurm.size)) {
    launch = place_by(kSlurm);
    if (const auto hosts = variable("SLURM_STEP_NODELIST")) launch.address = first_slurm_host(*hosts);
  }
  if (const auto address = variable("MASTER_ADDR")) launch.address = *address;
  launch.port = *integer("MASTER_PORT", 1, 65535, launch.port);
  launch.is_served = variable("TORCHELASTIC_USE_AGENT_STORE") == "True";
  launch.attempt = variable("TORCHELASTIC_RESTART_COUNT").value_or("0");
  return launch;
}

}  // namespace pictura
