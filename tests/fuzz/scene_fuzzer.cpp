// libFuzzer target: any bytes as a recorded scene. The macro PICTURA_FUZZ_NAME, a file's name, selects the format. If
// the environment variable PICTURA_FUZZ_SEEDS names a folder, the program first writes small scenes of that format to
// the folder, as first inputs:
//   PICTURA_FUZZ_SEEDS=seeds build/fuzz/tests/fuzz/gpudrive_fuzzer NEW seeds
#include <cstdint>
#include <cstdlib>

#include "pictura/common/support/file.h"
#include "pictura/tests/fuzz/fuzz_scene.h"

extern "C" int LLVMFuzzerInitialize(int*, char***) {
  const char* folder = std::getenv("PICTURA_FUZZ_SEEDS");
  if (!folder) return 0;
  pictura::make_output_folder(folder);
  const std::string name = PICTURA_FUZZ_NAME;
  const std::string suffix = name.substr(name.find('.') == std::string::npos ? 0 : name.find('.'));
  for (const auto& [file, bytes] : pictura::test::scene_seeds()) {
    if (file.find(suffix) != std::string::npos) pictura::write_file(std::string(folder) + "/" + file, bytes);
  }
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  pictura::test::fuzz_scene({reinterpret_cast<const char*>(data), size}, PICTURA_FUZZ_NAME);
  return 0;
}
