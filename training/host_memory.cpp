#include "pictura/training/host_memory.h"

#include <climits>
#ifdef __GLIBC__
#include <malloc.h>
#endif

namespace pictura {

void retain_freed_memory() {
#ifdef __GLIBC__
  mallopt(M_MMAP_MAX, 0);  // glibc accepts no threshold above 32 MB
  mallopt(M_TRIM_THRESHOLD, INT_MAX);
  mallopt(M_TOP_PAD, 64 << 20);
#endif
}

}  // namespace pictura
