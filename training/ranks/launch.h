// Launch of several processes that train together, from variables set by torchrun, SLURM or a user.
#pragma once

#include <string>

namespace pictura {

/// Place of a process among the processes that train together; by default it is the only process.
struct Launch {
  int rank = 0, size = 1;
  int local_rank = 0;                 // index among the processes of its host
  std::string address = "127.0.0.1";  // host of rank 0, where the processes meet
  int port = 29500;                   // port at that address
  bool is_served = false;             // whether the launcher (torchrun) listens at that port; else rank 0 listens
  std::string attempt;                // name of the launcher's attempt, which differs after a restart
};

/// Reads the launch from the variables that torchrun sets: RANK, WORLD_SIZE, LOCAL_RANK (default: RANK), MASTER_ADDR
/// (127.0.0.1) and MASTER_PORT (29500). Without RANK and WORLD_SIZE, reads it from the variables of SLURM's srun;
/// MASTER_ADDR then defaults to the first host of the step. Without any of these variables, there is one process.
/// Throws Error naming a variable that is missing or invalid.
Launch launch_from_environment();

/// Returns the first host of a SLURM list: "node7" of "node[7-9,12],other".
std::string first_slurm_host(const std::string& list);

}  // namespace pictura
