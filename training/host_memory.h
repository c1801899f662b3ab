// Memory of the host that the process keeps.
#pragma once

namespace pictura {

/// Keeps memory that is freed from now on in the process for what is allocated next, large blocks too, instead of
/// mapping it anew, page by page and zeroed by the kernel, for each tensor. Holds for the whole process; does nothing
/// where the C library is not glibc.
void keep_freed_memory();

}  // namespace pictura
