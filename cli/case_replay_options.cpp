#include "pictura/cli/case_replay_options.h"

#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/recording_options.h"

namespace pictura {

void add_case_replay_options(CLI::App* command, CaseReplayOptions* options_out, const std::string& case_help) {
  CLI::Option* const replay =
      command
          ->add_option("--replay", options_out->path,
                       "Page to write, which plays the scene of one case, follows its ego, and marks its road user")
          ->check(output_file({".html"}));
  add_number_option(command, "--case", options_out->number, case_help, 0)->needs(replay);
  add_cameras_option(command, &options_out->recording)->needs(replay);
}

}  // namespace pictura
