// Launch of processes that train together.
#pragma once

#include <string>

namespace pictura {

/// Place of a process in its group; default: the only process.
struct Launch {
  int rank = 0, size = 1;
  int local_rank = 0;                 // index of the process on its host
  std::string address = "127.0.0.1";  // host of rank 0
  int port = 29500;                   // port where the processes meet
  bool is_served = false;             // whether the launcher listens there; else rank 0 listens
  std::string attempt;                // launcher's attempt; differs after a restart
};

/// Reads torchrun's variables: RANK, WORLD_SIZE, LOCAL_RANK (default: RANK), MASTER_ADDR (127.0.0.1) and MASTER_PORT
/// (29500). Without RANK and WORLD_SIZE, reads those of SLURM's srun; MASTER_ADDR then defaults to the step's first
/// host. Without any, there is one process. Throws Error naming a missing or invalid variable.
Launch launch_from_environment();

/// Returns the first host of a SLURM list: "node7" for "node[7-9,12],other".
std::string first_slurm_host(const std::string& list);

}  // namespace pictura
