// Host memory that the process retains.
#pragma once

namespace pictura {

/// Retains freed memory, including large blocks, in the process for later allocations. Otherwise the operating system
/// would map and zero new memory, page by page, for each tensor. Affects the whole process; does nothing if the C
/// library is not glibc.
void retain_freed_memory();

}  // namespace pictura
