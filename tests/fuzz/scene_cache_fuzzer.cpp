// libFuzzer target: any bytes as a cached scene.
#include <cstddef>
#include <cstdint>

#include "pictura/tests/fuzz/fuzz_scene.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  pictura::test::fuzz_scene_cache({reinterpret_cast<const char*>(data), size});
  return 0;
}
