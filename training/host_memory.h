// Host memory that the process retains.
#pragma once

namespace pictura {

/// Retains freed memory in the process for later allocations, large blocks too, instead of mapping new memory for each
/// tensor page by page, zeroed by the kernel. Affects the whole process; does nothing if the C library is not glibc.
void retain_freed_memory();

}  // namespace pictura
