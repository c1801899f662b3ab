// Host memory retained by the process.
#pragma once

namespace pictura {

/// Makes the whole process keep freed memory for later allocations. Otherwise the operating system would map and zero
/// new pages for each tensor. Does nothing without glibc.
void retain_freed_memory();

}  // namespace pictura
