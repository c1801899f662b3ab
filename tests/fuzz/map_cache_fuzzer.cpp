// libFuzzer target: any bytes as a cached map.
#include "pictura/tests/fuzz/fuzz_map.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  pictura::test::fuzz_map_cache({reinterpret_cast<const char*>(data), size});
  return 0;
}
