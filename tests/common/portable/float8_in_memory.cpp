// Results of Float8 in memory: this file is compiled without AVX.
#include "pictura/tests/common/portable/float8_results.h"

namespace pictura {

std::vector<uint32_t> results_in_memory(const Float8Inputs& in) { return results_of(in); }

}  // namespace pictura
