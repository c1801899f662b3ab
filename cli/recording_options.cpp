#include "pictura/cli/recording_options.h"

#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/common/error.h"

namespace pictura {

void add_recording_options(CLI::App* command, RecordingOptions* options_out) {
  add_number_option(
      command, "--follow", options_out->followed,
      "Agent that the replay shows first, and whose decisions and images it contains; default: agent 0; in recorded "
      "scenes the self-driving car; in evaluated scenarios the agent with the most severe infraction",
      0, kMaxAgentsPerWorld - 1);
  add_cameras_option(command, options_out);
}

CLI::Option* add_cameras_option(CLI::App* command, RecordingOptions* options_out) {
  return command->add_flag(
      "--cameras", options_out->cameras,
      "Also record the followed agent's images, losslessly, with the cameras of its policy's training, or with the "
      "paper's cameras if there is no policy. A page contains at most 10 MB of images and draws the others itself");
}

void reject_recording_options(const CLI::App& command, const std::string& needed) {
  for (const char* option : {"--follow", "--cameras"}) {
    if (command.count(option) > 0) fail_usage("{}: has no effect without {}", option, needed);
  }
}

void write_replay_files(const Replay& replay, const std::string& page, const std::string& mcap) {
  const auto write_page = [&] {
    if (!page.empty()) write_replay_with_message(page, replay);
  };
  const auto write_messages = [&] {
    if (!mcap.empty()) write_mcap_with_message(mcap, replay);
  };
  call_all({write_page, write_messages});
}

}  // namespace pictura
