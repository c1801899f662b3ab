#include "pictura/apps/command.h"

#include <algorithm>
#include <csignal>
#include <string>

#include "pictura/apps/commands.h"
#include "pictura/apps/usage_error.h"
#include "pictura/bench/commands/bench.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/interrupt.h"
#include "pictura/version.h"

namespace pictura {

namespace {

void print_error(const std::string& message) { print_message("error: {}\n", printable(message)); }

/// Parses and runs the command line. Returns the exit status.
int run(CLI::App& app, int argc, char** argv) {
  try {
    app.parse(argc, argv);
    return 0;
  } catch (const CLI::Success& success) {  // --help, --version
    return app.exit(success);
  } catch (const CLI::ParseError& error) {
    print_error(usage_error(app, error));
    return 2;
  } catch (const UsageError& error) {
    print_error(error.what());
    return 2;
  } catch (const Interrupted& error) {
    print_error(error.what());
    return 128 + interrupting_signal();
  } catch (const Error& error) {
    print_error(error.what());
  } catch (const std::bad_alloc&) {
    print_error("out of memory");
  } catch (const std::exception& error) {
    // The message comes from a library. Lines after the first contain positions in the library's code.
    std::string message = error.what();
    message.erase(std::min(message.find('\n'), message.size()));
    const bool lacks_memory =
        message.find("out of memory") != std::string::npos || message.find("allocate memory") != std::string::npos;
    print_error(lacks_memory ? "out of memory: " + message : message);
  }
  return 1;
}

/// Closes stdout after a command that ended with `status`. Returns the status of the process.
int end_output(int status) {
  try {
    close_stdout();
  } catch (const Error& error) {
    print_error(error.what());
    return status == 0 ? 1 : status;
  }
  return status;
}

// Parts of the help about training.
#ifdef PICTURA_HAS_TORCH
constexpr const char *kOfTraining = "training and evaluation.\n",
                     *kExamplesOfTraining =
                         "  pictura train --config configs/demo.toml --out runs/demo\n"
                         "  pictura plot runs/demo --out curves.png\n";
#else
constexpr const char *kOfTraining =
                         "evaluation.\n"
                         "This build lacks torch, which trains policies and runs them on GPUs: pip install "
                         "'pictura[train]'.\n",
                     *kExamplesOfTraining = "  pictura evaluate models/vector.safetensors --map procedural:1-8\n";
#endif

}  // namespace

int run_command(int argc, char** argv) {
  open_standard_streams();
  catch_interrupts();
  // Without SIGXFSZ, writing beyond the file size limit (ulimit -f) causes a write error instead of killing the
  // process.
  std::signal(SIGXFSZ, SIG_IGN);
  CLI::App app{
      std::string("Self-play driving from rendered views: maps, simulation, images, ") + kOfTraining +
      "MAP is a .xodr file, a Lanelet2 .osm file (FILE.osm@LATITUDE,LONGITUDE sets the origin), a CARLA town's name\n"
      "(looked up in $PICTURA_DATA), procedural[:SEED], or city[:SEED]."};
  app.name("pictura");
  app.set_version_flag("--version", PICTURA_VERSION);
  app.require_subcommand(1);
  app.footer(
      "Examples:\n"
      "  pictura town --seed 7 --blocks 3x3 --out town.xodr\n"
      "  pictura map procedural:7 --png map.png\n"
      "  pictura render procedural --agents 40 --steps 50 --views 4 --out images\n"
      "  pictura simulate procedural --agents 40 --steps 300 --video drive.mp4\n"
      "  pictura replay procedural --agents 40 --out drive.html\n" +
      std::string(kExamplesOfTraining) + "Help of a subcommand: pictura render --help");
  add_town_command(app);
  add_map_command(app);
  add_render_command(app);
  add_simulate_command(app);
  add_replay_command(app);
#ifdef PICTURA_HAS_TORCH
  add_train_command(app);
#endif
  add_evaluate_command(app);
  add_probe_command(app);
  add_export_command(app);
  add_score_command(app);
  add_plot_command(app);
  add_completion_command(app);
  add_bench_command(app);
  reject_empty_values(&app);
  app.parse_complete_callback([&app] { check_files(&app); });

  return end_output(run(app, argc, argv));
}

}  // namespace pictura
