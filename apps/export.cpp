// `pictura export`: writes the weights of a policy without the state of its run, for releases or other tools.
#include "pictura/apps/commands.h"
#include "pictura/cli/backend_options.h"
#include "pictura/cli/evaluation_options.h"
#include "pictura/cli/file_options.h"
#include "pictura/cli/number_options.h"
#include "pictura/cli/report.h"
#include "pictura/commit.h"
#include "pictura/configuration/policy_section.h"
#include "pictura/policy/export_policy.h"

namespace pictura {

void add_export_command(CLI::App& app) {
  struct Arguments {
    std::string policy, out, weights = "bf16", size;
    std::vector<int> channels;
    bool json = false, average = false;
  };
  auto arguments = std::make_shared<Arguments>();
  CLI::App* command = app.add_subcommand("export", "Write the weights of a policy as safetensors");
  command->add_option("POLICY", arguments->policy, "Checkpoint written by train, or safetensors")
      ->check(input_file())
      ->required();
  command->add_option("--out", arguments->out, "File to write")->check(output_file({".safetensors"}))->required();
  command
      ->add_option("--weights", arguments->weights,
                   "bf16: rounded to 8 significant bits, half the size; f32: unchanged")
      ->check(one_of({"bf16", "f32"}).description("{bf16,f32}"))
      ->capture_default_str();
  add_average_option(command, &arguments->average);
  command->add_option("--size", arguments->size,
                      "New image size in pixels, WxH, an integer multiple of the policy's image size; the first "
                      "convolution is spread over patches that are larger by the same factor; default: unchanged");
  command
      ->add_option("--channels", arguments->channels,
                   "New channels of the convolutions, separated by commas, multiples of the policy's, the last one "
                   "unchanged; outputs are equal, up to the rounding of --weights, until the policy learns; default: "
                   "unchanged")
      ->delimiter(',')
      ->transform(whole_number(1, PolicySection::kMaxConvChannels))
      ->allow_extra_args(false);
  command->add_flag("--json", arguments->json, "Print one JSON object");
  command->footer(
      "The file contains all data with which the policy drives: weights, configuration, cameras. simulate, evaluate, "
      "replay and\n"
      "train --init-from accept it in place of a checkpoint; a run cannot be resumed from it. ONNX models are written "
      "in\n"
      "Python: pictura.torch.export_onnx(pictura.torch.load_policy(POLICY), \"policy.onnx\").\n"
      "Examples:\n"
      "  pictura export runs/town01/checkpoint.ckpt --out town01.safetensors\n"
      "  pictura export runs/town01/checkpoint.ckpt --weights f32 --out town01.safetensors\n"
      "  pictura export runs/town01/checkpoint.ckpt --average --out town01_average.safetensors\n"
      "  pictura export runs/demo/checkpoint.ckpt --size 96x54 --out demo_96x54.safetensors\n"
      "  pictura export models/perspective.safetensors --channels 128,128,256,256,128 --weights f32 --out "
      "wide.safetensors\n"
      "  pictura simulate Town01 --policy town01.safetensors --video drive.mp4");
  command->callback([arguments] {
    ExportOptions options{.commit = PICTURA_COMMIT, .average = arguments->average};
    options.weights = arguments->weights == "bf16" ? WeightType::bf16 : WeightType::f32;
    options.channels = arguments->channels;
    if (!arguments->size.empty()) {
      const Pair pixels = parse_pair("--size", arguments->size, 8192);
      options.size = ImageSize{pixels.first, pixels.second};
    }
    const ExportedPolicy exported = export_policy(arguments->policy, arguments->out, options);
    if (arguments->json) {
      print_json({{"out", arguments->out},
                  {"weights", arguments->weights},
                  {"parameters", exported.parameters},
                  {"bytes", exported.file_bytes},
                  {"updates", exported.updates},
                  {"agent_steps", exported.agent_steps},
                  {"policy_hash", exported.policy_hash}});
    } else {
      print_result("{}: {} parameters in {}, {} bytes; {} updates, {} agent-steps; policy hash {}\n", arguments->out,
                   exported.parameters, arguments->weights, exported.file_bytes, exported.updates, exported.agent_steps,
                   exported.policy_hash);
    }
  });
}

}  // namespace pictura
