// libFuzzer target: any bytes as a Lanelet2 file.
#include "pictura/tests/fuzz/fuzz_map.h"

extern "C" int LLVMFuzzerTestOneInput(const uint8_t* data, size_t size) {
  pictura::test::fuzz_lanelet2({reinterpret_cast<const char*>(data), size});
  return 0;
}
