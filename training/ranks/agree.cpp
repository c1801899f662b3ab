#include "pictura/training/ranks/agree.h"

#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/configuration/compare_configs.h"
#include "pictura/policy/saved_policy.h"
#include "pictura/training/ranks/ranks.h"

namespace pictura {

void check_equal_settings(const Config& config, const std::string& manner, Ranks* ranks) {
  const std::vector<std::string> configs = ranks->texts("config", to_toml(config)),
                                 manners = ranks->texts("manner", manner);
  for (size_t rank = 1; rank < configs.size(); ++rank) {
    const auto config_of = [&](size_t of) { return parse_saved_config(configs[of], fmt::format("rank {}", of)); };
    std::string difference = first_difference_of_ranks(config_of(0), config_of(rank));
    if (difference.empty() && manners[rank] != manners[0]) difference = manners[0] + " and " + manners[rank];
    PICTURA_CHECK(difference.empty(), "ranks 0 and {} have different settings: {}", rank, difference);
  }
}

bool any_rank(bool is_so, Communicator* communicator) { return communicator->max_of(is_so ? 1 : 0) > 0; }

bool any_rank_interrupted(Communicator* communicator) {
  const auto signal = static_cast<int>(communicator->max_of(interrupting_signal()));
  if (signal != 0) record_interrupt(signal);
  return signal != 0;
}

std::string file_of_first(const std::string& path, Communicator* communicator) {
  return communicator->from_first(communicator->is_first() ? read_policy_file(path) : "");
}

}  // namespace pictura
