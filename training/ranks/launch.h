// Launch of several processes that train together, from the variables that torchrun, SLURM or a person set.
#pragma once

#include <string>

namespace pictura {

/// Place of a process among those that train together; by default it is the only one.
struct Launch {
  int rank = 0, size = 1;
  int local_rank = 0;                 // among the processes of its host
  std::string address = "127.0.0.1";  // of the host of rank 0, where the processes meet
  int port = 29500;                   // at that address
  bool is_served = false;             // the launcher listens there (torchrun); else rank 0 does
  std::string attempt;                // names one of a launcher's attempts
};

/// Launch from RANK, WORLD_SIZE, LOCAL_RANK (absent: RANK), MASTER_ADDR (127.0.0.1) and MASTER_PORT (29500), as
/// torchrun sets them, or from what SLURM's srun sets, where MASTER_ADDR is by default the first host of the step.
/// Without any of them there is one process. Throws Error naming the variable that is missing or makes no sense.
Launch launch_from_environment();

/// First host of SLURM's list: "node7" of "node[7-9,12],other".
std::string first_slurm_host(const std::string& list);

}  // namespace pictura
