// `pictura town`: writes a procedural town as OpenDRIVE.
#include "pictura/apps/commands.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/common/error.h"
#include "pictura/common/support/file.h"
#include "pictura/map/procedural/procedural_town.h"

namespace pictura {

void add_town_command(CLI::App& app) {
  struct Arguments {
    TownOptions town;
    std::string family = town_families()[0].name, blocks = "3x3", out;
    bool json = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("town", "Write a procedural town as an OpenDRIVE file");
  add_seed_option(command, &arguments->town.seed, "Equal seeds give equal files");
  std::vector<std::string> families;
  for (const TownFamily& family : town_families()) families.emplace_back(family.name);
  command
      ->add_option(
          "--family", arguments->family,
          "Family of towns, which sets the defaults of the other options; this help shows the defaults of procedural")
      ->check(CLI::IsMember(families))
      ->capture_default_str();
  command->add_option("--blocks", arguments->blocks, "Blocks of houses along x and y, as AxB")->capture_default_str();
  for (const TownFeature& feature : town_features()) {
    add_number_option(command, fmt::format("--{}", feature.name), arguments->town.*feature.value, feature.help,
                      feature.low, feature.high);
  }
  command->add_option("--out", arguments->out, ".xodr file to write")->check(output_file({".xodr"}))->required();
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "An option that is a share selects at least one element if it is above 0.\n"
      "Examples:\n"
      "  pictura town --seed 7 --blocks 4x3 --out town.xodr && pictura map town.xodr --png town.png\n"
      "  pictura town --roundabouts 1 --ring-road 0 --hills-m 0 --out roundabouts.xodr\n"
      "  pictura town --blocks 6x6 --lights 1 --hills-m 0 --out lights.xodr\n"
      "  pictura town --family city --seed 7 --out city.xodr\n"
      "Maps with options need no file: pictura map procedural:7:blocks=4x3,roundabouts=1");
  command->callback([arguments, command] {
    TownOptions town = town_family_of(arguments->family)->defaults;
    town.seed = arguments->town.seed;
    for (const TownFeature& feature : town_features()) {
      if (command->count(fmt::format("--{}", feature.name)) > 0) {
        town.*feature.value = arguments->town.*feature.value;
      }
    }
    if (command->count("--blocks") > 0) {
      const Pair blocks = parse_pair("--blocks", arguments->blocks, kMaxTownBlocks);
      town.blocks_x = blocks.first;
      town.blocks_y = blocks.second;
    }
    const std::string text = procedural_town(town);
    write_file(arguments->out, text);
    if (arguments->json) {
      Json object{{"out", arguments->out},
                  {"seed", town.seed},
                  {"blocks_x", town.blocks_x},
                  {"blocks_y", town.blocks_y},
                  {"bytes", text.size()}};
      for (const TownFeature& feature : town_features()) object[feature.name] = town.*feature.value;
      print_json(object);
    } else {
      print_result("{}: {} bytes; to view it: pictura map {} --png town.png\n", arguments->out, text.size(),
                   arguments->out);
    }
  });
}

}  // namespace pictura
